"""CUSUM tests and their thresholds for a stated rate of false alarms."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy import optimize

from railui.arrays import FloatArray

OVERSHOOT: Final = 1.166  # of the threshold: Siegmund's correction for a normal random walk
DAYS_PER_MONTH: Final = 365.25 / 12.0


def run_length(threshold: float, reference_value: float) -> float:
    """Mean number of standard normal scores until a one-sided CUSUM exceeds its threshold.

    (exp(2 k b) - 2 k b - 1) / (2 k^2) with b = h + 1.166: D. Siegmund, Sequential Analysis (Springer 1985), ch. X.

    Examples
    --------
    >>> round(run_length(4.0, 0.5)), round(run_length(5.0, 0.5))  # exact: 336 and 930
    (338, 938)
    """
    b, k = threshold + OVERSHOOT, reference_value
    return float((np.exp(2.0 * k * b) - 2.0 * k * b - 1.0) / (2.0 * k * k))


def threshold_of_rate(rate: float, tests: int, blocks_per_month: float, reference_value: float) -> float:
    """Threshold at which several two-sided CUSUM tests together raise so many false alarms per month.

    Parameters
    ----------
    rate
        False alarms per month of one vehicle.
    tests
        Two-sided tests of a vehicle; their rates add up, which is an upper limit where they are correlated.
    blocks_per_month
        Scores per month.

    Examples
    --------
    >>> h = threshold_of_rate(0.02, 30, 4.35, 0.5)
    >>> round(2 * 30 * 4.35 / run_length(h, 0.5), 6)
    0.02
    """
    wanted = 2.0 * tests * blocks_per_month / rate
    if run_length(0.0, reference_value) >= wanted:
        return 0.0
    k = reference_value
    highest = (np.log(4.0 * k * k * wanted + 10.0) + 5.0) / (2.0 * k)
    return float(optimize.brentq(lambda h: np.log(run_length(h, k) / wanted), 0.0, highest))


def step(upper: FloatArray, lower: FloatArray, z: FloatArray, reference_value: float) -> tuple[FloatArray, FloatArray]:
    """Add scores z to the sums of upward and downward changes; a score of NaN changes nothing.

    Source: E. S. Page, Biometrika 41 (1954) 100.
    """
    known = np.isfinite(z)
    x = np.where(known, z, 0.0)
    up = np.maximum(upper + x - reference_value, 0.0)
    down = np.maximum(lower - x - reference_value, 0.0)
    return np.where(known, up, upper), np.where(known, down, lower)
