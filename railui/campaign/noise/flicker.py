"""Flicker noise of a channel: white noise and a part with a density of 1/f, from the upper half of its spectrum.

A sum of relaxation processes whose corner frequencies are a constant ratio apart has a density of 1/f between them
(Keshner, 1/f noise, Proc. IEEE 70 (1982) 212).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.noise.record import Record
from railui.campaign.noise.spectrum import NoiseSpectrum, corner_frequencies, markov_density
from railui.dsp.spectra import welch

WINDOW_SAMPLES: Final = 512
MIN_WINDOWS: Final = 8
BANDS: Final = 8
SHARES: Final = (0.5, 0.98)  # of half the sampling rate: above the motions of a vehicle
INDEPENDENT_SHARE: Final = 0.5  # of the periodogram values: Hann windows that overlap by half, neighbouring lines
REWEIGHTINGS: Final = 5


class FlickerNoise(NamedTuple):
    """Density w + a/f of a channel.

    Attributes
    ----------
    white
        w, one-sided [1/Hz].
    slope
        a, one-sided.
    share
        Share of the part 1/f in the middle of the bands.
    z
        Estimate of a over its standard deviation.
    deviation
        Largest relative deviation of a band from the law.
    """

    white: float
    slope: float
    share: float
    z: float
    deviation: float

    def spectrum(self, low: float, high: float, dt: float) -> NoiseSpectrum:
        """Return white noise and Markov processes of equal variance with the power of w + a/f in a band [Hz]."""
        corners = corner_frequencies(low, high)
        f = np.geomspace(low, high, 400)
        power = sum(float(np.trapezoid(markov_density(f, c, dt), f)) for c in corners)
        sd = float(np.sqrt(self.slope * np.log(high / low) / power)) if power > 0.0 else 0.0
        return NoiseSpectrum(float(np.sqrt(self.white / (2.0 * dt))), tuple((c, sd) for c in corners))


def flicker_noise(records: Sequence[Record], channel: str) -> FlickerNoise | None:
    """Estimate flicker noise from the records of a channel at one sampling rate; None: too short a record.

    Least squares of the mean densities of bands, each weighted by its expected standard deviation.
    """
    present = [r for r in records if channel in r.columns and np.ptp(r.columns[channel]) > 0.0]
    present = [r for r in present if len(r.columns[channel]) >= MIN_WINDOWS * WINDOW_SAMPLES and r.dt == present[0].dt]
    if not present:
        return None
    windows = [2 * len(r.columns[channel]) // WINDOW_SAMPLES - 1 for r in present]
    spectra = [welch(r.columns[channel], 1.0 / r.dt, WINDOW_SAMPLES) for r in present]
    f, density = spectra[0][0], np.average([s[1] for s in spectra], axis=0, weights=windows)
    edges = np.searchsorted(f, np.linspace(*SHARES, BANDS + 1) * f[-1])
    bands = [slice(a, b) for a, b in pairwise(edges)]
    values = INDEPENDENT_SHARE * sum(windows) * np.array([b.stop - b.start for b in bands])
    return _fit(np.array([f[b].mean() for b in bands]), np.array([density[b].mean() for b in bands]), values)


def _fit(f: FloatArray, density: FloatArray, values: FloatArray) -> FlickerNoise:
    """Fit w + a/f to densities, each a mean of so many independent values.

    The standard deviation of a mean of n periodogram values of a density S is S/sqrt(n) (Bartlett, Biometrika 37
    (1950) 1).
    """
    columns = np.stack([np.ones_like(f), 1.0 / f], axis=1)
    fitted = density
    for _ in range(REWEIGHTINGS):
        weights = np.sqrt(values) / fitted
        covariance = np.linalg.inv((columns.T * weights**2) @ columns)
        white, slope = covariance @ (columns.T @ (weights**2 * density))
        z = slope / np.sqrt(covariance[1, 1])
        if white < 0.0:  # the bound: all of it is 1/f
            white, slope = 0.0, float(np.average(density * f, weights=values))
        elif slope < 0.0:
            white, slope = float(np.average(density, weights=values)), 0.0
        fitted = columns @ np.array([white, slope])
    middle = len(f) // 2
    share = float(slope / f[middle] / fitted[middle])
    return FlickerNoise(float(white), float(slope), share, float(z), float(np.abs(density / fitted - 1.0).max()))
