"""Residual of a free decay: what a wrong law leaves lies at the frequency of the motion and its multiples."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.dsp.spectra import hann, periodogram
from railui.identification.estimation.residual_coherence import UNKNOWN, Share
from railui.identification.prediction import Prediction

HARMONICS = (1, 2, 3)
LINE_HALF_WIDTH = 0.2  # of the frequency of the motion
GAP = (0.35, 0.65)  # between two harmonics, where the density is that of noise
MIN_PERIODS = 10  # in a record that resolves them
WINDOW_WIDTH = 1.5  # values of a spectrum with a Hann window for each independent one


def share_at_harmonics(predictions: Sequence[Prediction]) -> Share:
    """Share of the residual's power at the frequency of a free motion and its multiples, beyond noise of any colour.

    A wrong law changes frequency, decay or shape of the oscillation. Noise and drift of the sensor have a continuous
    spectrum: its density at a line is interpolated from those in the gaps on both sides.

    Parameters
    ----------
    predictions
        Of a model on records of a free motion; those that diverge, or are shorter than ten periods, are left out.

    Returns
    -------
    Share
        Of all channels and records, and its standard error in noise of the interpolated density; NaN where no record
        resolves the lines.
    """
    excess = variance = total = 0.0
    for prediction in predictions:
        comparison = prediction.comparison
        if prediction.diverged_at is not None:
            continue
        for measured, simulated in zip(comparison.measured, comparison.simulated, strict=True):
            power = _line_power(measured - simulated, simulated, 1.0 / comparison.dt)
            excess, variance, total = excess + power.excess, variance + power.variance, total + power.total
    return Share(excess / total, float(np.sqrt(variance)) / total) if total > 0.0 else UNKNOWN


class _LinePower(NamedTuple):
    """Power at the harmonics beyond noise, its variance in noise, and all power; zeros: the lines are not resolved."""

    excess: float
    variance: float
    total: float


def _line_power(residual: FloatArray, motion: FloatArray, rate: float) -> _LinePower:
    """Power of a residual [n] at the harmonics of a motion [n]."""
    window = hann(len(residual))
    f, of_motion = periodogram((motion - motion.mean()) * window, rate)
    _, density = periodogram((residual - residual.mean()) * window, rate)
    fundamental = float(f[int(np.argmax(of_motion))])
    if fundamental < MIN_PERIODS * f[1] or (max(HARMONICS) + GAP[1]) * fundamental > f[-1]:
        return _LinePower(0.0, 0.0, 0.0)

    def mean_density(low: float, high: float) -> tuple[float, float]:
        """Mean between two multiples of the fundamental, and how many independent values it has."""
        inside = density[(f >= low * fundamental) & (f <= high * fundamental)]
        return float(inside.mean()), len(inside) / WINDOW_WIDTH

    gaps = [mean_density(k + GAP[0], k + GAP[1]) for k in (0, *HARMONICS)]
    excess = variance = 0.0
    for k, (below, n_below), (above, n_above) in zip(HARMONICS, gaps[:-1], gaps[1:], strict=True):
        line, n_line = mean_density(k - LINE_HALF_WIDTH, k + LINE_HALF_WIDTH)
        # a mean of n values has the relative variance 1/n, the geometric mean of two means a quarter of the sum
        noise, width = float(np.sqrt(below * above)), 2.0 * LINE_HALF_WIDTH * fundamental
        excess += (line - noise) * width
        variance += (noise * width) ** 2 * (1.0 / n_line + 0.25 / n_below + 0.25 / n_above)
    return _LinePower(excess, variance, float(density.sum() * f[1]))
