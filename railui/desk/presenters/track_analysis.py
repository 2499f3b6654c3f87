"""Analysis of a track for the Track panel: lines, spectrum, standard deviations, assessment of its sections."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.text import Text

from railui.arrays import FloatArray
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.bars import Bar
from railui.desk.widgets.plot_data import Line, PlotData
from railui.track.excitation import TrackSource, is_track_file, resolve_track
from railui.track.metrics import BANDS, NearestSpectrum, band_sd, nearest_spectrum, psd
from railui.track.spectra import spectrum_density, spectrum_sd

MM_PER_M = 1e3
REFERENCE_SPECTRA = ("erri_b176_low", "erri_b176_high")
MAX_CLASS_LENGTH = 14  # characters
MIN_SD = 1e-9  # m, lower bound of the scale of the bars
MAX_SCORE = 100.0


@dataclass(frozen=True, eq=False)
class TrackAnalysis:
    """Analysis of a track.

    density [m^2/(rad/m)] of the lateral deviation over wavenumber [rad/m]; bands: standard deviation [m] in the
    wavelength bands `BANDS`; nearest: the most similar standard spectrum.
    """

    name: str
    source: TrackSource
    wavenumber: FloatArray
    density: FloatArray
    bands: FloatArray
    nearest: NearestSpectrum | None


def resolve_named_track(name: str) -> Path | str:
    """Return a track as a path if it is a file, else its spec."""
    return Path(name) if is_track_file(name) else name


def analyse_track(name: str) -> TrackAnalysis:
    """Analyse a track given by its file or spec."""
    source = resolve_track(resolve_named_track(name))
    spectrum = psd(source.track)
    nearest = nearest_spectrum(source.track)
    return TrackAnalysis(name, source, spectrum.wavenumber, spectrum.yw, band_sd(source.track), nearest)


def summary_text(analysis: TrackAnalysis) -> Text:
    """Return name, length, spacing, standard deviation and nearest standard spectrum."""
    track = analysis.source.track
    text = Text(no_wrap=True, overflow="ellipsis")
    text.append(f"{analysis.source.name}\n", "bold")
    text.append(f"{track.length:.6g} m, every {track.spacing:g} m, yw sd {MM_PER_M * track.yw.std():.3g} mm\n")
    if analysis.nearest is not None:
        text.append(f"nearest spectrum: {analysis.nearest.factor:.3g} times {analysis.nearest.name}", "dim")
    return text


def column_plot(analysis: TrackAnalysis, column: str, unit: str) -> PlotData:
    """Plot a column of the track over distance; unit: mm or mrad."""
    track = analysis.source.track
    y = MM_PER_M * np.asarray(getattr(track, column))
    if not np.any(y):
        return PlotData(Axis("s", "m"), Axis(column, unit), placeholder="zero in this spectrum")
    return PlotData(Axis("s", "m"), Axis(column, unit), (Line(track.s, y),))


def spectrum_plot(analysis: TrackAnalysis) -> PlotData:
    """Plot the spectrum of the lateral deviation and the nearest standard spectrum."""
    lines = [Line(analysis.wavenumber, MM_PER_M**2 * analysis.density, "track", "current")]
    if analysis.nearest is not None:
        nearest = spectrum_density(analysis.nearest.name, "yw", analysis.wavenumber)
        lines.insert(0, Line(analysis.wavenumber, MM_PER_M**2 * nearest, analysis.nearest.name, "base"))
    x = Axis("wavenumber", "rad/m", log=True, low=0.02, high=10.0)
    return PlotData(x, Axis("S", "mm²/(rad/m)", log=True), lines)


def band_rows(analysis: TrackAnalysis) -> list[Bar]:
    """Return the standard deviation by wavelength band, with those of the reference spectra."""
    reference_sd = {name: [spectrum_sd(name, "yw", *band) for band in BANDS] for name in REFERENCE_SPECTRA}
    largest = max(float(analysis.bands.max(initial=0.0)), *(max(sds) for sds in reference_sd.values()), MIN_SD)
    rows = []
    for i, ((low, high), sd) in enumerate(zip(BANDS, analysis.bands, strict=True)):
        text = f"{MM_PER_M * sd:.3g} mm"
        rows.append(Bar(f"{low:g} to {high:g} m", float(sd / largest), text, is_emphasised=True))
        for name, sds in reference_sd.items():
            rows.append(Bar(f"  {name}", float(sds[i] / largest), f"{MM_PER_M * sds[i]:.3g} mm", role="base"))
    return rows


def section_rows(assessment: Mapping[str, Any]) -> list[Bar]:
    """Return a row per track section, worst ride first: score, class, rank by geometry."""
    rows = []
    for i, section in enumerate(assessment["stretches"]):
        quality_class = section["class"][:MAX_CLASS_LENGTH]
        text = f"{section['score']:4.0f} {quality_class:{MAX_CLASS_LENGTH}} #{section['rank_geometry']}"
        name = f"{section['from']:.0f} to {section['to']:.0f}"
        rows.append(Bar(name, section["score"] / MAX_SCORE, text, is_emphasised=i == 0))
    return rows


def section_caption(assessment: Mapping[str, Any]) -> str:
    """Return the caption of the section rows."""
    agreement = assessment["agreement"]
    correlation = "" if agreement is None else f", correlation {agreement:.2f}"
    return f"m, score, class (no acceptance), rank by geometry{correlation}"


def section_window(analysis: TrackAnalysis, section: Mapping[str, Any]) -> tuple[float, float]:
    """Return the ends of a section as fractions of the track length."""
    track = analysis.source.track
    start, end = ((section[key] - track.s[0]) / track.length for key in ("from", "to"))
    return start, min(1.0, end)
