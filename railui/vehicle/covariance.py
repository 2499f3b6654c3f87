"""Covariance of estimated parameters as a file states it: definite up to the rounding of its digits."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

# relative to the largest eigenvalue of the correlation matrix: twice what rounding to six digits changes at most
INDEFINITE_TOLERANCE: Final = 1e-6


def is_indefinite(covariance: ArrayLike) -> bool:
    """Return True for a symmetric matrix [n, n] with a negative eigenvalue, which no parameters can have.

    The eigenvalues are those of the correlation matrix, so that units do not decide.

    >>> is_indefinite([[1.0, 2.0], [2.0, 1.0]]), is_indefinite([[1e12, 4e3], [4e3, 2.5e-5]]), is_indefinite([[0.0]])
    (True, False, False)
    """
    matrix = np.asarray(covariance, dtype=float)
    sd = np.sqrt(np.diag(matrix))
    if matrix[sd == 0].any():  # a parameter without variance has no covariance
        return True
    varied = matrix[np.ix_(sd > 0, sd > 0)]
    if not varied.size:
        return False
    values = np.linalg.eigvalsh(varied / np.outer(sd[sd > 0], sd[sd > 0]))
    return bool(values[0] < -INDEFINITE_TOLERANCE * values[-1])
