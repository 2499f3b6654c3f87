"""Estimates of a run without the pull of its prior, so that runs of different information are comparable."""

from __future__ import annotations

from typing import Final

import numpy as np

from railui.arrays import FloatArray
from railui.fleet.summary import RunSummary
from railui.identification.estimation.block_products import scaled_inverse

MIN_SHARE: Final = 0.02  # of the prior variance that a run must remove at least for its estimate to count


def free_estimates(summary: RunSummary) -> tuple[FloatArray, FloatArray]:
    """Estimates of the parameters and their standard deviations [p], without the pull towards the prior mean.

    Notes
    -----
    With the covariance P = s^2 (S'S + s^2 L)^-1 and the prior precision L the expected value of the estimate x is
    m + (I - P L)(x_true - m), and its covariance P - P L P. The diagonal k of I - P L is the determined share; the
    result is m + (x - m) / k. What other parameters add by their distance from their prior means is left out.
    """
    p = len(summary.paths)
    estimate, k = summary.estimate[:p], np.clip(summary.determined[:p], MIN_SHARE, 1.0)
    precision = summary.variance * np.maximum(1.0 - summary.determined[:p], 0.0) / summary.sd[:p] ** 2
    a = summary.gram[1 : 1 + p, 1 : 1 + p] + np.diag(precision)
    inverse = scaled_inverse(a)
    pull = a @ (estimate - summary.x) - summary.gram[1 : 1 + p, 0]  # precision (m - x)
    beyond = np.where(precision > 0.0, estimate - summary.x - pull / np.where(precision > 0.0, precision, 1.0), 0.0)
    variance = summary.variance * (np.diag(inverse) - inverse**2 @ precision)
    floor = 1e-6 * summary.sd[:p] ** 2
    return estimate + (1.0 - k) / k * beyond, np.sqrt(np.maximum(variance, floor)) / k
