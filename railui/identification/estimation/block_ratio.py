"""Standard error of a ratio of sums over blocks of time."""

from __future__ import annotations

import numpy as np

from railui.arrays import FloatArray
from railui.identification.estimation.block_merging import independent_edges


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
    total, n = denominator.sum(), len(numerator)
    if n < 2:
        return float("inf")
    scatter = numerator - numerator.sum() / total * denominator
    scatter = np.add.reduceat(scatter, independent_edges(scatter[:, None]))
    n = len(scatter)
    return float(np.sqrt(n / (n - 1) * np.sum(scatter**2)) / abs(total))
