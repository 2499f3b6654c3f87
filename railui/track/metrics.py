"""What a track contains: standard deviations in wavelength bands, spectrum, the nearest known spectrum."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.track.line import Track
from railui.track.spectra import QUANTITIES, SPECTRA, Quantity, spectrum_sd

BANDS: Final = ((3.0, 25.0), (25.0, 70.0), (70.0, 150.0))  # m, the wavelength ranges D1 to D3 of EN 13848


def band_sd(track: Track, bands: Sequence[tuple[float, float]] = BANDS, quantity: Quantity = "yw") -> FloatArray:
    """Standard deviation [m, rad] of a track column per band of wavelengths [m], shape [bands].

    The line through both ends is taken off (a jump between them would leak into every band), then the lines
    of the whole record's transform inside the band are summed. Raises ValueError for a band that is not
    increasing.

    >>> from railui.track import synthetic_track
    >>> track = synthetic_track("erri_b176_low", length=10000.0, seed=1)
    >>> [round(1e3 * float(sd), 2) for sd in band_sd(track, [(3, 25), (25, 70)])]
    [0.71, 1.2]
    """
    if quantity not in QUANTITIES:
        raise ValueError(f"no track quantity {quantity!r}: known are {', '.join(QUANTITIES)}")
    column: FloatArray = getattr(track, quantity)
    n = column.size
    slope = (column[-1] - column[0]) / (n - 1)
    power = 2 * np.abs(np.fft.rfft(column - slope * np.arange(n))) ** 2 / n**2
    if n % 2 == 0:
        power[-1] /= 2
    wavelength = np.full(power.size, np.inf)
    wavelength[1:] = n * track.spacing / np.arange(1, power.size)
    found = []
    for shortest, longest in bands:
        if not 0 < shortest < longest:
            raise ValueError(f"a band runs from a shorter to a longer wave: {shortest:g} to {longest:g} m")
        found.append(np.sqrt(power[(wavelength >= shortest) & (wavelength < longest)].sum()))
    return np.array(found)


class TrackSpectrum(NamedTuple):
    """One-sided densities over wavenumber [rad/m]: yw, gauge [m^2/(rad/m)], phiw [rad^2/(rad/m)]."""

    wavenumber: FloatArray
    yw: FloatArray
    phiw: FloatArray
    gauge: FloatArray


def psd(track: Track, segment: float = 500.0) -> TrackSpectrum:
    """One-sided power spectral density per rad/m by Welch's method, Hann segments [m] half overlapped.

    Each segment's line of best fit is removed. Segments are no longer than the track; the wavenumber 0 is
    left out.

    >>> from railui.track import synthetic_track
    >>> found = psd(synthetic_track("fra_4", length=4000.0, seed=2))
    >>> found.wavenumber.shape == found.gauge.shape
    True
    """
    from scipy import signal

    points = min(len(track), max(8, round(segment / track.spacing)))
    columns = np.stack([track.yw, track.phiw, track.gauge])
    n, per_cycle = signal.welch(columns, 1 / track.spacing, nperseg=points, detrend=signal.detrend)
    density = np.asarray(per_cycle[:, 1:], dtype=np.float64) / (2 * np.pi)
    return TrackSpectrum(2 * np.pi * np.asarray(n[1:], dtype=np.float64), density[0], density[1], density[2])


class NearestSpectrum(NamedTuple):
    """The known family closest to a track, and how many times its standard deviation the track has."""

    name: str
    factor: float


def nearest_spectrum(track: Track, bands: Sequence[tuple[float, float]] = BANDS) -> NearestSpectrum | None:
    """The known spectrum with the nearest lateral standard deviations, by ratio; None for a flat track.

    >>> from railui.track import synthetic_track
    >>> nearest_spectrum(synthetic_track("erri_b176_high", length=4000.0, seed=3)).name
    'erri_b176_high'
    """
    measured = band_sd(track, bands)
    seen = measured > 1e-3 * measured.max()
    if not measured.max() > 0:
        return None
    best: tuple[float, NearestSpectrum] | None = None
    for name in SPECTRA:
        known = np.array([spectrum_sd(name, "yw", low, high) for low, high in bands])
        ratio = np.log(measured[seen] / known[seen])
        distance = float(np.sqrt(np.mean(ratio**2)))
        if best is None or distance < best[0]:
            best = (distance, NearestSpectrum(name, float(np.exp(ratio.mean()))))
    return None if best is None else best[1]
