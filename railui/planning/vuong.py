"""Vuong's test: which of two models, nested or not, predicts a run better."""

from __future__ import annotations

import numpy as np

from railui.arrays import FloatArray


def vuong_statistic(first: FloatArray, second: FloatArray, distances: tuple[float, float] = (0.0, 0.0)) -> float:
    """Return Vuong's statistic of two models from their squared errors per block of time.

    Standard normal where both predict equally well; above 1.64 the first is better at the one-sided 5 % level, below
    -1.64 the second. Source: Q. H. Vuong, Econometrica 57 (1989) 307.

    Parameters
    ----------
    first, second : array [block]
        Squared errors over the variance of the noise.
    distances
        Squared distances D of both to their estimates before, in standard deviations; they add to the errors. A
        distance has the variance 4 D of the square of a normal variable with this mean and unit variance.

    Examples
    --------
    >>> import numpy as np
    >>> round(vuong_statistic(np.array([1.0, 1.2, 0.9, 1.1]), np.array([2.0, 2.4, 2.1, 2.3])), 2)
    23.0
    """
    more = np.asarray(second) - np.asarray(first)
    variance = len(more) * float(np.var(more, ddof=1)) if len(more) > 1 else 0.0
    total = float(np.sum(more)) + distances[1] - distances[0]
    sd = float(np.sqrt(variance + 4.0 * sum(distances)))
    return total / sd if sd > 0.0 else 0.0
