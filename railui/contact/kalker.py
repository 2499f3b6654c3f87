"""Creep coefficients of the contact ellipse: Kalker's linear theory, factors of Vermeulen and Johnson."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.special import ellipe, ellipk

# C11, C22, C23 at Poisson's ratio 0, 1/4, 1/2: a row for a/b 0.1 to 1, then one for b/a 0.9 to 0.1
KALKER_TABLE = np.array(
    [
        [2.51, 3.31, 4.85, 2.51, 2.52, 2.53, 0.334, 0.473, 0.731],
        [2.59, 3.37, 4.81, 2.59, 2.63, 2.66, 0.483, 0.603, 0.809],
        [2.68, 3.44, 4.80, 2.68, 2.75, 2.81, 0.607, 0.715, 0.889],
        [2.78, 3.53, 4.82, 2.78, 2.88, 2.98, 0.720, 0.823, 0.977],
        [2.88, 3.62, 4.83, 2.88, 3.01, 3.14, 0.827, 0.929, 1.07],
        [2.98, 3.72, 4.91, 2.98, 3.14, 3.31, 0.930, 1.03, 1.18],
        [3.09, 3.81, 4.97, 3.09, 3.28, 3.48, 1.03, 1.14, 1.29],
        [3.19, 3.91, 5.05, 3.19, 3.41, 3.65, 1.13, 1.25, 1.40],
        [3.29, 4.01, 5.12, 3.29, 3.54, 3.82, 1.23, 1.36, 1.51],
        [3.40, 4.12, 5.20, 3.40, 3.67, 3.98, 1.33, 1.47, 1.63],
        [3.51, 4.22, 5.30, 3.51, 3.81, 4.16, 1.44, 1.59, 1.77],
        [3.65, 4.36, 5.42, 3.65, 3.99, 4.39, 1.58, 1.75, 1.94],
        [3.82, 4.54, 5.58, 3.82, 4.21, 4.67, 1.76, 1.95, 2.18],
        [4.06, 4.78, 5.80, 4.06, 4.50, 5.04, 2.01, 2.23, 2.50],
        [4.37, 5.10, 6.11, 4.37, 4.90, 5.56, 2.35, 2.62, 2.96],
        [4.84, 5.57, 6.57, 4.84, 5.48, 6.31, 2.88, 3.24, 3.70],
        [5.57, 6.34, 7.34, 5.57, 6.40, 7.51, 3.79, 4.32, 5.01],
        [6.96, 7.78, 8.82, 6.96, 8.14, 9.79, 5.72, 6.63, 7.89],
        [10.7, 11.7, 12.9, 10.7, 12.8, 16.0, 12.2, 14.6, 18.0],
    ]
)
RATIOS = np.concatenate([np.arange(1, 11) / 10.0, 10.0 / np.arange(9, 0, -1)])
MIN_RATIO = float(RATIOS[0])
MAX_RATIO = float(RATIOS[-1])


class KalkerCoefficients(NamedTuple):
    """C11 (longitudinal), C22 (lateral), C23 (lateral by spin)."""

    c11: float
    c22: float
    c23: float


def kalker_coefficients(ratio: float, poisson: float = 0.25) -> KalkerCoefficients:
    """Interpolate Kalker's linear creep coefficients for a/b (a along the rail) and Poisson's ratio.

    Exact at the points of the table; between them monotone cubics in log(a/b), parabolas in Poisson's ratio of 1/C
    (which is nearly a straight line).

    Raises
    ------
    ValueError
        Beyond the table (a/b 0.1 to 10, Poisson's ratio 0 to 0.5).

    References
    ----------
    Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), table E.3.

    Examples
    --------
    >>> kalker_coefficients(0.5)
    KalkerCoefficients(c11=3.62, c22=3.01, c23=0.929)
    """
    if not MIN_RATIO * (1 - 1e-9) <= ratio <= MAX_RATIO * (1 + 1e-9) or not 0.0 <= poisson <= 0.5:
        raise ValueError(f"a/b {ratio:.3g}, Poisson's ratio {poisson:.3g}: the table is for 0.1 to 10 and 0 to 0.5")
    row = PchipInterpolator(np.log(RATIOS), np.log(KALKER_TABLE))(np.clip(np.log(ratio), *np.log(RATIOS[[0, -1]])))
    softness = 1.0 / np.exp(row).reshape(3, 3)
    v = poisson
    weight = np.array([8.0 * (v - 0.25) * (v - 0.5), -16.0 * v * (v - 0.5), 8.0 * v * (v - 0.25)])
    return KalkerCoefficients(*(round(float(1.0 / (row @ weight)), 12) for row in softness))


class VermeulenJohnsonFactors(NamedTuple):
    """phi (longitudinal) and psi (lateral) of Vermeulen and Johnson; G pi a b/phi is the slope of their law."""

    phi: float
    psi: float


def vermeulen_johnson_factors(ratio: float, poisson: float = 0.25) -> VermeulenJohnsonFactors:
    """Return the factors of Vermeulen and Johnson for a/b (a along the rail) and Poisson's ratio.

    Raises ValueError for a ratio a/b that is not positive.

    B, C, D: complete elliptic integrals of Jahnke and Emde. a < b: phi = B - nu (D - C), psi = B - nu (a/b)^2 C;
    a > b: phi = (b/a) (D - nu (D - C)), psi = (b/a) (D - nu C). Their slopes are 8 to 27 % above Kalker's.
    Source: Vermeulen and Johnson, Journal of Applied Mechanics 31 (1964).

    >>> [round(x, 4) for x in vermeulen_johnson_factors(1.0)]  # pi/4 (1 - 3 nu/4), pi/4 (1 - nu/4)
    [0.6381, 0.7363]
    """
    if not ratio > 0.0:
        raise ValueError(f"a/b must be positive: {ratio:g}")
    thin = min(ratio, 1.0 / ratio)
    k2 = 1.0 - thin * thin
    if k2 < 1e-6:
        B, C, D = np.pi / 4.0, np.pi / 16.0, np.pi / 4.0
    else:
        K, E = float(ellipk(k2)), float(ellipe(k2))
        D = (K - E) / k2
        B = K - D
        C = (D - B) / k2
    if ratio <= 1.0:
        return VermeulenJohnsonFactors(float(B - poisson * (D - C)), float(B - poisson * thin * thin * C))
    return VermeulenJohnsonFactors(float(thin * (D - poisson * (D - C))), float(thin * (D - poisson * C)))
