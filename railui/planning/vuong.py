"""Vuong's test: which of two models, nested or not, predicts a run better."""

from __future__ import annotations

import numpy as np

from railui.arrays import FloatArray


def vuong_statistic(first: FloatArray, second: FloatArray) -> float:
    """Return Vuong's statistic of two models from their squared errors per block of time.

    Standard normal where both predict equally well; above 1.64 the first is better at the one-sided 5 % level, below
    -1.64 the second. Source: Q. H. Vuong, Econometrica 57 (1989) 307.

    Parameters
    ----------
    first, second : array [block]
        Squared errors over the variance of the noise.

    Examples
    --------
    >>> import numpy as np
    >>> round(vuong_statistic(np.array([1.0, 1.2, 0.9, 1.1]), np.array([2.0, 2.4, 2.1, 2.3])), 2)
    23.0
    """
    more = np.asarray(second) - np.asarray(first)
    sd = float(np.std(more, ddof=1)) if len(more) > 1 else 0.0
    return float(np.sqrt(len(more)) * np.mean(more) / sd) if sd > 0 else 0.0
