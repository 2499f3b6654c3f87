"""Student's t: the standard normal variable of the same probability, and the noncentrality of a power."""

from __future__ import annotations

import numpy as np
from scipy import special

from railui.arrays import FloatArray


def as_normal(t: FloatArray | float, freedom: FloatArray | float) -> FloatArray:
    """Convert Student's t to the standard normal variable of the same probability.

    Source: Wallace, Ann. Math. Statist. 30 (1959) 1121.

    >>> as_normal(3.143, 6.0).round(2), as_normal(-2.326, 1e9).round(3)  # one in a hundred: 2.326
    (np.float64(2.32), np.float64(-2.326))
    """
    n = np.asarray(freedom)
    return np.asarray(np.sign(t) * (8 * n + 1) / (8 * n + 3) * np.sqrt(n * np.log1p(np.square(t) / n)))


def from_normal(z: float, freedom: float) -> float:
    """Convert a standard normal variable, 0 or more, to Student's t of the same probability.

    The inverse of `as_normal`, whose error it has: at 3 it is 0 to 6 % too large from 3 degrees of freedom on, and far
    too large below.

    >>> round(from_normal(2.32, 6.0), 2)
    3.14
    """
    n = freedom
    return float(np.sqrt(n * np.expm1((z * (8 * n + 3) / (8 * n + 1)) ** 2 / n)))


def noncentrality(t: float, freedom: float, power_quantile: float) -> float:
    """Return the noncentrality with which Student's t exceeds a value with the power of a normal quantile.

    The difference t s - z of the estimated standard deviation s, as a multiple of the true one, and a standard normal
    variable z counts as normal: mean and variance of s are exact, and a power of 90 % is met within 2 %.

    Source: Jennett and Welch, J. Royal Statist. Soc. Suppl. 6 (1939) 80.

    >>> from scipy.special import nctdtr
    >>> [round(1.0 - float(nctdtr(n, noncentrality(4.0, n, 1.2816), 4.0)), 2) for n in (2.0, 8.0, 40.0)]
    [0.89, 0.9, 0.9]
    """
    mean = float(np.sqrt(2.0 / freedom) * special.poch(0.5 * freedom, 0.5))
    return t * mean + power_quantile * float(np.sqrt(1.0 + t**2 * max(1.0 - mean**2, 0.0)))
