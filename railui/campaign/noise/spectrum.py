"""Spectrum of a column's noise: white noise and first-order Markov processes, whose sum resembles 1/f."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.core import sosfilt

CORNER_RATIO = 4.0  # of neighbouring corner frequencies; a sum of such processes follows 1/f within 12 %
CORNERS = 4


def corner_frequencies(lowest: float, highest: float) -> tuple[float, ...]:
    """Corner frequencies [Hz] of coloured noise from the lower end of a band, below half its upper end."""
    return tuple(c for k in range(CORNERS) if (c := lowest * CORNER_RATIO**k) < 0.5 * highest)


def markov_density(f: FloatArray, corner: float, dt: float) -> FloatArray:
    """One-sided density [1/Hz] of a sampled first-order Markov process of unit variance; infinite corner: white."""
    rho = float(np.exp(-2.0 * np.pi * corner * dt))
    return np.asarray(2.0 * dt * (1.0 - rho**2) / (1.0 - 2.0 * rho * np.cos(2.0 * np.pi * f * dt) + rho**2))


@dataclass(frozen=True)
class NoiseSpectrum:
    """Noise of a column.

    Attributes
    ----------
    white
        Standard deviation of the part that is independent from sample to sample.
    coloured
        Corner frequency [Hz] and standard deviation of each first-order Markov process.
    """

    white: float
    coloured: tuple[tuple[float, float], ...] = ()

    def density(self, f: FloatArray, dt: float) -> FloatArray:
        """One-sided power spectral density [1/Hz] at frequencies [Hz], sampled every dt [s]."""
        parts = [(np.inf, self.white), *self.coloured]
        return np.asarray(sum(sd**2 * markov_density(f, corner, dt) for corner, sd in parts) + 0.0 * f)

    def scaled(self, factor: float) -> NoiseSpectrum:
        """The same colour at another level."""
        return NoiseSpectrum(factor * self.white, tuple((corner, factor * sd) for corner, sd in self.coloured))

    def draw(self, rng: np.random.Generator, samples: int, dt: float) -> FloatArray:
        """Draw a stationary Gaussian realisation [n]."""
        series = self.white * rng.standard_normal(samples)
        for corner, sd in self.coloured:
            rho = float(np.exp(-2.0 * np.pi * corner * dt))
            start = np.array([rho * rng.standard_normal(), 0.0])
            section = np.array([[np.sqrt(1.0 - rho**2), 0.0, 0.0, 1.0, -rho, 0.0]])
            series += sd * sosfilt(section, rng.standard_normal(samples), start)
        return series
