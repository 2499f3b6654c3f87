"""Metrics of a track: standard deviations in wavelength bands, spectral densities, the nearest known spectrum."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.dsp.spectra import welch
from railui.track.line import Track
from railui.track.spectra import QUANTITIES, SPECTRA, Quantity, spectrum_sd

BANDS: Final = (
    (3.0, 25.0),
    (25.0, 70.0),
    (70.0, 150.0),
)  # m: D1 and D2 of EN 13848, and D3 (for alignment to 200 m) up to 150 m
MIN_SEGMENT_SAMPLES: Final = 8  # of a spectral density
MIN_BAND_SHARE: Final = 1e-3  # of the largest standard deviation, for a band to be compared with known spectra


def band_sd(track: Track, bands: Sequence[tuple[float, float]] = BANDS, quantity: Quantity = "yw") -> FloatArray:
    """Return the standard deviation [m, rad] of a track column per band of wavelengths [m], shape [band].

    The line through both ends is subtracted (a jump between them would leak into every band), then the lines of the
    transform of the whole record inside the band are summed. Raises ValueError for a band that is not increasing.

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
    sd = []
    for shortest, longest in bands:
        if not 0 < shortest < longest:
            raise ValueError(f"a band runs from a shorter to a longer wavelength: {shortest:g} to {longest:g} m")
        sd.append(np.sqrt(power[(wavelength >= shortest) & (wavelength < longest)].sum()))
    return np.array(sd)


class TrackSpectrum(NamedTuple):
    """One-sided power spectral densities over wavenumber [rad/m]: yw, gauge [m^2/(rad/m)], phiw [rad^2/(rad/m)]."""

    wavenumber: FloatArray
    yw: FloatArray
    phiw: FloatArray
    gauge: FloatArray


def psd(track: Track, segment: float = 500.0) -> TrackSpectrum:
    """Estimate one-sided power spectral densities per rad/m by Welch's method, with segments of a length [m].

    Hann window, overlap by half; the line of best fit of each segment is subtracted. Segments are no longer than the
    track; the wavenumber 0 is omitted.

    >>> from railui.track import synthetic_track
    >>> spectrum = psd(synthetic_track("fra_4", length=4000.0, seed=2))
    >>> spectrum.wavenumber.shape == spectrum.gauge.shape
    True
    """
    samples = min(len(track), max(MIN_SEGMENT_SAMPLES, round(segment / track.spacing)))
    columns = (track.yw, track.phiw, track.gauge)
    spectra = [welch(column, 1 / track.spacing, samples, "line") for column in columns]
    cycles = spectra[0][0]
    yw, phiw, gauge = (per_cycle[1:] / (2 * np.pi) for _, per_cycle in spectra)
    return TrackSpectrum(2 * np.pi * cycles[1:], yw, phiw, gauge)


class NearestSpectrum(NamedTuple):
    """Known spectrum closest to a track, and the ratio of the standard deviation of the track to it."""

    name: str
    factor: float


def nearest_spectrum(track: Track, bands: Sequence[tuple[float, float]] = BANDS) -> NearestSpectrum | None:
    """Return the known spectrum with the nearest lateral standard deviations, by ratio; None for a flat track.

    >>> from railui.track import synthetic_track
    >>> nearest_spectrum(synthetic_track("erri_b176_high", length=4000.0, seed=3)).name
    'erri_b176_high'
    """
    measured = band_sd(track, bands)
    is_compared = measured > MIN_BAND_SHARE * measured.max()
    if not measured.max() > 0:
        return None
    best: tuple[float, NearestSpectrum] | None = None
    for name in SPECTRA:
        known = np.array([spectrum_sd(name, "yw", low, high) for low, high in bands])
        ratio = np.log(measured[is_compared] / known[is_compared])
        distance = float(np.sqrt(np.mean(ratio**2)))
        if best is None or distance < best[0]:
            best = (distance, NearestSpectrum(name, float(np.exp(ratio.mean()))))
    return None if best is None else best[1]
