"""Spectral density of a track: that of its published spectrum, or Welch's estimate from a measured one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.dsp.spectra import csd
from railui.track.excitation import TrackSource
from railui.track.line import Track
from railui.track.spectra import QUANTITIES, spectrum_density
from railui.track.synthetic import parse_spec

MAX_SEGMENT: Final = 500.0  # m, of Welch's segments
MIN_SEGMENTS: Final = 4  # into which a short track is divided
MIN_SEGMENT_SAMPLES: Final = 16


@dataclass(frozen=True, eq=False)
class TrackDensity:
    """One-sided spectral densities of yw, phiw and gauge per rad/m between two wavenumbers.

    Attributes
    ----------
    lowest, highest : float
        Band [rad/m]; the density is zero outside.
    lines : array [line] or None
        Wavenumbers of Welch's estimate [rad/m], between which the density is linear; None for a published spectrum.
    origin : str
        Source of the density, for a report.
    """

    lowest: float
    highest: float
    origin: str
    lines: FloatArray | None = None
    _values: ComplexArray | None = None
    _name: str = ""
    _factor: float = 1.0

    def __call__(self, wavenumber: FloatArray) -> ComplexArray:
        """Return the densities [wavenumber, quantity, quantity], Hermitian; published quantities are uncorrelated."""
        w = np.asarray(wavenumber, dtype=float)
        inside = (w >= self.lowest) & (w <= self.highest)
        density = np.zeros((len(w), len(QUANTITIES), len(QUANTITIES)), dtype=complex)
        for i, first in enumerate(QUANTITIES):
            if self._values is None or self.lines is None:
                safe = np.where(inside, w, self.highest)
                density[:, i, i] = self._factor * spectrum_density(self._name, first, safe)
                continue
            for j in range(len(QUANTITIES)):
                density[:, i, j] = np.interp(w, self.lines, self._values[:, i, j])
        density[~inside] = 0.0
        return density


def track_density(source: TrackSource) -> TrackDensity:
    """Return the spectral density of a track.

    Of a synthetic track the published spectrum between its shortest and its longest wavelength, of which the track is
    a sample; of a file Welch's estimate, with the cross densities.

    >>> from railui.track.excitation import resolve_track
    >>> density = track_density(resolve_track("erri_b176_low length=500"))
    >>> f"{density(np.array([1.0]))[0, 0, 0].real:.3e}", round(density.highest, 3)
    ('8.573e-08', 2.094)
    """
    if source.file is None and source.seed is not None:
        spec = parse_spec(source.name)
        band = f"{spec.shortest:g} to {spec.longest:g} m"
        scale = "" if spec.scale == 1 else f", amplitudes times {spec.scale:g}"
        low, high = 2 * np.pi / spec.longest, 2 * np.pi / spec.shortest
        origin = f"spectrum {spec.name}, {band}{scale}"
        return TrackDensity(low, high, origin, _name=spec.name, _factor=spec.scale**2)
    return _estimated(source.track)


def _estimated(track: Track) -> TrackDensity:
    samples = round(min(MAX_SEGMENT, track.length / MIN_SEGMENTS) / track.spacing)
    samples = min(max(samples, MIN_SEGMENT_SAMPLES), len(track))
    columns = [getattr(track, name) for name in QUANTITIES]
    rate = 1.0 / track.spacing
    estimates = [[csd(second, first, rate, samples, "line") for second in columns] for first in columns]
    cycles = estimates[0][0][0][1:]
    values = np.array([[density[1:] for _, density in row] for row in estimates]) / (2 * np.pi)
    lines = 2 * np.pi * cycles
    origin = f"Welch's estimate of the track, segments of {samples * track.spacing:.4g} m, Hann window"
    return TrackDensity(float(lines[0]), float(lines[-1]), origin, lines, np.moveaxis(values, -1, 0).astype(complex))
