"""Control by sister vehicles: what runs on the same section in the same block have in common."""

from __future__ import annotations

from typing import Final

import numpy as np

from railui.arrays import FloatArray
from railui.fleet.mixed_model import HUBER

ITERATIONS: Final = 8


def common_deviation(
    deviation: FloatArray, variance: FloatArray, prior: FloatArray, others: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Estimate what runs have in common [m, q], and its variance, by Huber's M-estimator about a prior of mean zero.

    Parameters
    ----------
    deviation, variance : array [n, q]
        Of each run.
    prior : array [m, q]
        Variance of the common deviation.
    others : array [m, n]
        1 for the runs that count in each of m estimates.

    Notes
    -----
    Iteratively reweighted least squares from zero: P. J. Huber, Robust Statistics (Wiley 1981), ch. 7.
    """
    found = np.zeros((len(others), deviation.shape[1]))
    precision = 1.0 / np.maximum(prior, 1e-300)
    sd = np.sqrt(variance)
    for _ in range(ITERATIONS):
        distance = np.abs(deviation[None] - found[:, None]) / sd[None]
        weight = others[:, :, None] * np.minimum(1.0, HUBER / np.maximum(distance, 1e-12)) / variance[None]
        total = weight.sum(axis=1) + precision
        found = (weight * deviation[None]).sum(axis=1) / total
    return found, 1.0 / total
