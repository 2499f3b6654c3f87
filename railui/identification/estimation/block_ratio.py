"""Standard error of a ratio of sums over blocks of time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.identification.estimation.block_merging import independent_edges


class RatioScatter(NamedTuple):
    """Standard error of a ratio, and its degrees of freedom: one less than the independent blocks."""

    standard_error: float
    degrees_of_freedom: int


def ratio_standard_error(numerator: FloatArray, denominator: FloatArray) -> float:
    """Compute the standard error of a ratio r = sum(x)/sum(y) over n blocks.

    It is sqrt(n/(n - 1) sum((x - r y)^2))/|sum(y)|. Blocks whose neighbours are correlated are merged first.

    Parameters
    ----------
    numerator, denominator : array [block]
        x and y.

    Returns
    -------
    float
        Infinite for a single block, which has no scatter.

    References
    ----------
    Cochran, Sampling Techniques, 1977, chapter 6: ratio estimators.

    Examples
    --------
    >>> ratio_standard_error(np.array([1.0, 1.0]), np.array([2.0, 2.0]))
    0.0
    >>> ratio_standard_error(np.array([0.0, 2.0]), np.array([2.0, 2.0]))
    0.5
    """
    return ratio_scatter(numerator, denominator).standard_error


def ratio_scatter(numerator: FloatArray, denominator: FloatArray) -> RatioScatter:
    """Compute the standard error of `ratio_standard_error` with its degrees of freedom, those of merged blocks.

    >>> ratio_scatter(np.array([0.0, 2.0]), np.array([2.0, 2.0]))
    RatioScatter(standard_error=0.5, degrees_of_freedom=1)
    """
    total, n = denominator.sum(), len(numerator)
    if n < 2:
        return RatioScatter(float("inf"), 0)
    scatter = numerator - numerator.sum() / total * denominator
    scatter = np.add.reduceat(scatter, independent_edges(scatter[:, None]))
    n = len(scatter)
    return RatioScatter(float(np.sqrt(n / (n - 1) * np.sum(scatter**2)) / abs(total)), n - 1)
