"""Standard error of a ratio of sums over blocks of time."""

from __future__ import annotations

import numpy as np

from railui.arrays import FloatArray


def ratio_standard_error(numerator: FloatArray, denominator: FloatArray) -> float:
    """Compute the standard error of a ratio r = sum(x)/sum(y) over n independent blocks.

    It is sqrt(n/(n - 1) sum((x - r y)^2))/|sum(y)|.

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
    return float(np.sqrt(n / (n - 1) * np.sum(scatter**2)) / abs(total))
