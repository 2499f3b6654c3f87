"""Track: synthetic, measured or designed, with its name, file and seed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, Self

from numpy.typing import ArrayLike

from railui.api.display import Summarised, SummaryRow, draw_on
from railui.api.units import in_si
from railui.arrays import FloatArray
from railui.track import Track as Irregularities
from railui.track import TrackSpec, equally_spaced
from railui.track.excitation import TrackSource, resolve_track

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

    from railui.ride_quality.evaluation import TrackLike

UNITS: Final = {"s": "m", "yw": "m", "phiw": "rad", "gauge": "m", "curvature": "1/m", "cant": "m"}
QUANTITIES: Final[tuple[Literal["yw", "phiw", "gauge"], ...]] = ("yw", "phiw", "gauge")


@dataclass(frozen=True, eq=False)
class Track(TrackSource, Summarised):
    """Track irregularities under the leading wheelset, equally spaced, with their origin.

    It is built by `synthetic`, `from_spec`, `load`, `from_arrays` or `from_frame`. Every function of `railui` takes it
    in the place of a path or a spec.

    Attributes
    ----------
    name : str
    file : Path or None
    seed : int or None
        Seed of a synthetic track.
    notes : tuple of str

    Examples
    --------
    >>> track = Track.synthetic("erri_b176_low", length=2000.0, seed=1)
    >>> track.length, track.spacing, track.yw.shape, track.units["phiw"]
    (1999.9, 0.1, (20000,), 'rad')
    """

    @classmethod
    def of(cls, track: TrackLike, seed: int | None = None) -> Self:
        """Return a track, spec or file as this class; exceptions as `resolve_track`."""
        source = resolve_track(track, seed)
        return cls(**{item.name: getattr(source, item.name) for item in fields(TrackSource)})

    @classmethod
    def synthetic(
        cls,
        name: str,
        length: float = 1000.0,
        seed: int = 0,
        *,
        spacing: float = 0.1,
        shortest: float = 3.0,
        longest: float = 150.0,
        scale: float = 1.0,
    ) -> Self:
        """Generate a track with a published spectrum; parameters [m] and exceptions as `railui.synthetic_track`."""
        return cls.of(str(TrackSpec(name, length, seed, spacing, shortest, longest, scale)))

    @classmethod
    def from_spec(cls, spec: str, seed: int | None = None) -> Self:
        """Generate a track by its spec, "erri_b176_low length=2000 seed=1"; ValueError for a faulty one.

        seed: replaces that of the spec.
        """
        from railui.track import parse_spec

        parsed = parse_spec(spec)
        return cls.of(str(parsed if seed is None else replace(parsed, seed=seed)))

    @classmethod
    def load(cls, path: str | Path, seed: int | None = None) -> Self:
        """Read a track, a designed line (YAML) or the track of a run.

        seed: of the synthetic irregularities of a designed line.

        Raises
        ------
        FileProblems
            With every problem of the file.
        """
        return cls.of(Path(path), seed)

    @classmethod
    def from_arrays(
        cls,
        s: ArrayLike,
        yw: ArrayLike,
        phiw: ArrayLike | None = None,
        gauge: ArrayLike | None = None,
        *,
        curvature: ArrayLike | None = None,
        cant: ArrayLike | None = None,
        units: Mapping[str, str] | None = None,
        spacing: float | None = None,
        name: str | None = None,
    ) -> Self:
        """Build a track of arrays.

        Parameters
        ----------
        s : array_like
            Distance along the track.
        yw : array_like
            Lateral deviation of the track centre line.
        phiw, gauge : array_like, optional
            Cross-level as an angle, and gauge deviation; by default 0.
        curvature, cant : array_like, optional
            Curvature (positive with the centre at +y) and cant (positive where the left rail is higher) of the line.
        units : mapping, optional
            Units by the name of the argument; SI by default.
        spacing : float, optional
            Spacing [m] to which samples are interpolated that are not equally spaced.
        name : str, optional

        Raises
        ------
        FileProblems
            For a unit of another dimension.
        ValueError
            For columns that differ in length, are not finite or not equally spaced.

        Examples
        --------
        >>> import numpy as np
        >>> s = np.arange(0.0, 500.0, 0.25)
        >>> track = Track.from_arrays(s, 2.0 * np.sin(s), units={"yw": "mm"}, name="sine")
        >>> track.name, round(float(track.yw.max()), 6)
        ('sine', 0.002)
        """
        given = {"s": s, "yw": yw, "phiw": phiw, "gauge": gauge, "curvature": curvature, "cant": cant}
        present = {key: values for key, values in given.items() if values is not None}
        columns: dict[str, Any] = dict(in_si(present, UNITS, units, name or "track"))
        track = Irregularities(**columns) if spacing is None else equally_spaced(**columns, spacing=spacing)
        built = cls.of(track)
        return built if name is None else replace(built, name=name)

    @classmethod
    def from_frame(
        cls,
        frame: pandas.DataFrame,
        *,
        units: Mapping[str, str] | None = None,
        spacing: float | None = None,
        name: str | None = None,
    ) -> Self:
        """Build a track of the columns s, yw, phiw, gauge, curvature and cant of a frame; others are left out.

        Units by default as in `frame.attrs["units"]`; parameters and exceptions as `from_arrays`. s may be the index.
        """
        table = frame.reset_index() if "s" not in frame.columns and frame.index.name == "s" else frame
        columns = {key: table[key].to_numpy() for key in UNITS if key in table.columns}
        for key in ("s", "yw"):
            if key not in columns:
                raise ValueError(f"the frame has no column {key!r}: it needs s and yw")
        stated = units if units is not None else frame.attrs.get("units", {})
        kept = {key: unit for key, unit in stated.items() if key in columns}
        return cls.from_arrays(**columns, units=kept, spacing=spacing, name=name)

    @property
    def units(self) -> Mapping[str, str]:
        """Units of the columns."""
        return UNITS

    @property
    def columns(self) -> dict[str, FloatArray]:
        """Columns [sample] by name in SI; curvature and cant only of a line with curves."""
        names = UNITS if self.track.has_curves else ("s", "yw", "phiw", "gauge")
        return {name: getattr(self.track, name) for name in names}

    @property
    def s(self) -> FloatArray:
        """Distance [sample] in m."""
        return self.track.s

    @property
    def yw(self) -> FloatArray:
        """Lateral deviation [sample] in m."""
        return self.track.yw

    @property
    def phiw(self) -> FloatArray:
        """Cross-level [sample] in rad."""
        return self.track.phiw

    @property
    def gauge(self) -> FloatArray:
        """Gauge deviation [sample] in m."""
        return self.track.gauge

    @property
    def length(self) -> float:
        """Distance from the first to the last sample [m]."""
        return self.track.length

    @property
    def spacing(self) -> float:
        """Distance between two samples [m]."""
        return self.track.spacing

    def analyse(self) -> dict[str, Any]:
        """Return standard deviations by band of wavelengths, spectrum and nearest known spectrum; SI."""
        return analyse_track(self)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON document that `railui track --spectrum` writes."""
        from railui.api.document import json_document

        return json_document("track", self.analyse(), [self.file] if self.file is not None else [], self.seed)

    def save(self, path: str | Path) -> Path:
        """Write the track as a file, atomically; return the path."""
        from railui.track.reader import save_track

        track = self.track
        line = (track.curvature, track.cant) if track.has_curves else (None, None)
        return save_track(path, track.s, track.yw, track.phiw, track.gauge, track.conventions, *line)

    def to_frame(self) -> pandas.DataFrame:
        """Return the columns as a pandas.DataFrame over s; ImportError without pandas."""
        from railui.api.frames import data_frame

        return data_frame(self.columns, "s", {name: UNITS[name] for name in self.columns})

    def to_xarray(self) -> xarray.Dataset:
        """Return the columns as an xarray.Dataset over s, with units; ImportError without xarray."""
        from railui.api.frames import data_set

        return data_set(self.columns, "s", UNITS, {"title": self.name})

    def plot(self, quantity: str = "yw", ax: Axes | None = None) -> Axes:
        """Draw a column along the track: yw and gauge [mm], phiw [mrad], curvature [1/km], cant [mm]."""
        from railui.report.figures.drawing import BLUE, axis_label

        unit = {"phiw": "mrad", "curvature": "1/km"}.get(quantity, "mm")

        def draw(on: Axes) -> None:
            on.plot(self.s, 1e3 * self.columns[quantity], lw=0.7, color=BLUE)
            on.set_xlabel("s [m]")
            on.set_ylabel(axis_label(quantity, unit))

        return draw_on(ax, draw)

    def plot_spectrum(self, ax: Axes | None = None) -> Axes:
        """Draw the one-sided power spectral density of yw per rad/m."""
        from railui.report.figures.drawing import BLUE
        from railui.track import psd

        def draw(on: Axes) -> None:
            spectrum = psd(self.track)
            on.loglog(spectrum.wavenumber, spectrum.yw, lw=0.9, color=BLUE)
            on.set_xlabel("wavenumber [rad/m]")
            on.set_ylabel("PSD of yw [m²/(rad/m)]")

        return draw_on(ax, draw)

    def summary_title(self) -> str:
        """Return the name."""
        return self.name

    def summary_rows(self) -> list[SummaryRow]:
        """Return length, spacing and the standard deviations of yw by band of wavelengths."""
        rows = [SummaryRow("length", self.length, "m"), SummaryRow("spacing", self.spacing, "m")]
        bands = self.analyse()["bands"]
        return [*rows, *(SummaryRow(f"sd yw, {b['from']:g} to {b['to']:g} m", b["sd_yw"], "m") for b in bands)]

    def summary_notes(self) -> tuple[str, ...]:
        """Return the notes."""
        return self.notes


def analyse_track(track: TrackLike) -> dict[str, Any]:
    """Analyse the irregularities of a track, as `railui track --spectrum`.

    Parameters
    ----------
    track : Track, spec or path

    Returns
    -------
    dict
        track, length, spacing, samples; `bands`: standard deviations by band of wavelengths; `nearest`: nearest known
        spectrum; `spectrum`: one-sided densities per rad/m; conventions, notes.

    Raises
    ------
    FileProblems
        For a faulty file.
    ValueError
        For a faulty spec.

    Examples
    --------
    >>> analyse_track("fra_4 length=4000 seed=2")["nearest"]["name"]
    'fra_4'
    """
    from railui.track import BANDS, band_sd, nearest_spectrum, psd

    source = resolve_track(track)
    line = source.track
    deviations = {quantity: band_sd(line, quantity=quantity) for quantity in QUANTITIES}
    bands = [
        {"from": low, "to": high, **{f"sd_{name}": float(sd[i]) for name, sd in deviations.items()}}
        for i, (low, high) in enumerate(BANDS)
    ]
    nearest, spectrum = nearest_spectrum(line), psd(line)
    notes = list(source.notes)
    if line.length < 3 * BANDS[-1][1]:
        notes.append(
            f"the track is {line.length:.4g} m long: it has few waves of more than {line.length / 3:.3g} m, "
            "their standard deviation is uncertain"
        )
    return {
        "track": source.name,
        "length": line.length,
        "spacing": line.spacing,
        "samples": len(line),
        "bands": bands,
        "nearest": None if nearest is None else {"name": nearest.name, "factor": nearest.factor},
        "spectrum": {name: getattr(spectrum, name) for name in spectrum._fields},
        "conventions": list(line.conventions),
        "notes": [*notes, "spectrum: one-sided, per rad/m"],
    }
