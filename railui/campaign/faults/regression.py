"""Linear regression with standard errors from parts of a record that are left out."""

from __future__ import annotations

import numpy as np

from railui.arrays import FloatArray

BLOCKS = 8  # of the jackknife


def jackknife_regression(inputs: FloatArray, output: FloatArray) -> FloatArray:
    """Return coefficients and standard errors [input, 2] of a linear regression by blocks that are left out.

    inputs: [input, n], output: [n]; their means do not count.
    """
    starts = np.arange(BLOCKS) * len(output) // BLOCKS
    x = np.vstack([inputs, output])
    x -= x.mean(axis=1, keepdims=True)
    products = np.add.reduceat(x[:, None] * x[None], starts, axis=2)

    def solve(gram: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.lstsq(gram[:-1, :-1], gram[:-1, -1])[0])

    total = products.sum(axis=2)
    without = np.array([solve(total - products[..., k]) for k in range(BLOCKS)])
    variance = (BLOCKS - 1) / BLOCKS * np.sum((without - without.mean(axis=0)) ** 2, axis=0)
    return np.stack([solve(total), np.sqrt(variance)], axis=1)
