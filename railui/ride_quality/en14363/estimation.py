"""Estimated maximum of a sample of section values: one-dimensional, or by regression on the cant deficiency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.arrays import FloatArray

FACTORS: Final = {"running safety": 3.0, "track loading": 2.2, "running behaviour": 2.2, "quasi-static": 0.0}
# Two-sided confidence of the two-dimensional method, to which k = 3 and 2.2 correspond: at 25 sections the quantiles of
# Student for a further value are 2.86 and 2.11, one-sided ones would be 2.55 and 1.75. From memory of UIC 518.
CONFIDENCE: Final = {"running safety": 0.99, "track loading": 0.95, "running behaviour": 0.95}
MIN_SPREAD: Final = 0.010  # m, standard deviation of the cant deficiency below which no line is fitted
MIN_VALUES: Final = 5  # of a regression


@dataclass(frozen=True)
class Estimate:
    """Estimated maximum with number, mean and standard deviation (n - 1) of the values; None where undefined."""

    value: float | None
    count: int
    mean: float
    sd: float | None
    method: str
    rule: str


def estimate_one_dimensional(values: FloatArray, factor: float) -> Estimate:
    """Return mean + k s of section values [n], s with n - 1.

    >>> estimate_one_dimensional(np.array([1.0, 2.0, 3.0]), 3.0).value
    5.0
    """
    mean = float(values.mean())
    sd = float(values.std(ddof=1)) if values.size > 1 else None
    value = mean if factor == 0.0 else None if sd is None else mean + factor * sd
    rule = f"mean + {factor:g} s" if factor else "mean"
    return Estimate(value, int(values.size), mean, sd, "one-dimensional", rule)


def estimate_two_dimensional(
    values: FloatArray, cant_deficiency: FloatArray, target: float, confidence: float | None
) -> Estimate | None:
    """Return the upper prediction limit of a regression line on the cant deficiency at a target.

    a + b I + t s_e sqrt(1 + 1/n + (I - mean I)^2 / sum (I_i - mean I)^2), t of Student with n - 2 degrees of freedom
    at a two-sided confidence, s_e^2 = sum of squared residuals/(n - 2); the line alone without a confidence. Source:
    prediction interval of linear regression.

    Parameters
    ----------
    values, cant_deficiency : FloatArray
        Of the sections [n]; m.
    target : float
        Cant deficiency of the estimation [m].
    confidence : float or None
        Two-sided: of the interval whose upper end is the limit.

    Returns
    -------
    Estimate or None
        None for fewer than five values, or where the standard deviation of the cant deficiency is below 10 mm.
    """
    n = values.size
    if n < MIN_VALUES or cant_deficiency.std() < MIN_SPREAD:
        return None
    deviation = cant_deficiency - cant_deficiency.mean()
    squares = float(deviation @ deviation)
    b = float(deviation @ values) / squares
    distance = target - float(cant_deficiency.mean())
    value = float(values.mean()) + b * distance
    rule = f"regression on the cant deficiency, at {1e3 * target:.4g} mm"
    if confidence is not None:
        from scipy.special import stdtrit

        residuals = values - values.mean() - b * deviation
        s_e = np.sqrt(float(residuals @ residuals) / (n - 2))
        value += float(stdtrit(n - 2, 0.5 * (1.0 + confidence)) * s_e * np.sqrt(1.0 + 1.0 / n + distance**2 / squares))
        rule += f", upper end of the {100 * confidence:g} % prediction interval"
    return Estimate(value, n, float(values.mean()), float(values.std(ddof=1)), "two-dimensional", rule)
