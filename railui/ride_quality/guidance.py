"""Guidance: share of flange contact of a Gaussian displacement, and its part of the score."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray

LEAST_SHARE: Final = 1e-6  # of flange contact: better than this earns nothing
FAR_OUT: Final = -30.0  # standard deviations: erfc is 0 from -38 on


def log_normal(x: ArrayLike) -> FloatArray:
    """ln Phi(x), the logarithm of the normal distribution, to its last digits however far out.

    By erfc; where that would be too small, below -30, by the asymptotic series of Mills' ratio. As log_ndtr of
    scipy.special, which would take a quarter of a second to read. Source: Abramowitz, Stegun, 26.2.12.

    >>> log_normal([-100.0, 0.0, 8.0]).round(6).tolist()
    [-5005.524209, -0.693147, -0.0]
    """
    z = np.asarray(x, dtype=np.float64)
    far = z < FAR_OUT
    share = _erfc(np.abs(np.where(far, 0.0, z)) / np.sqrt(2.0)) / 2.0
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        near = np.where(z > 0, np.log1p(-share), np.log(share))
        out = -np.where(far, z, FAR_OUT)
        squared = out**2
        series = 1.0 - (1.0 - (3.0 - (15.0 - (105.0 - 945.0 / squared) / squared) / squared) / squared) / squared
        beyond = -0.5 * squared - np.log(out) - 0.5 * np.log(2.0 * np.pi) + np.log(series)
    return np.asarray(np.where(far, beyond, near), dtype=np.float64)


_erfc: Final = np.vectorize(math.erfc, otypes=[np.float64])


def log_flange_fraction_gaussian(mean: ArrayLike, sd: ArrayLike, clearance: float) -> FloatArray:
    """ln phi_G, the share of time with abs(e) >= clearance [m] of a Gaussian e, exact far out in the tails.

    phi_G = 1/2 erfc((c - m)/(sqrt2 sd)) + 1/2 erfc((c + m)/(sqrt2 sd)); -inf where sd is 0 inside the
    clearance. Source: Broersen 1974.

    >>> round(float(log_flange_fraction_gaussian(0.0, 1e-4, 7e-3)), 1)
    -2454.5
    """
    m, s = np.broadcast_arrays(np.asarray(mean, dtype=np.float64), np.asarray(sd, dtype=np.float64))
    still = s == 0
    with np.errstate(over="ignore"):
        right = (m - clearance) / np.where(still, 1.0, s)
        left = (-m - clearance) / np.where(still, 1.0, s)
        right = np.where(still, np.where(m > clearance, np.inf, -np.inf), right)
        left = np.where(still, np.where(-m > clearance, np.inf, -np.inf), left)
    with np.errstate(invalid="ignore"):
        found = np.logaddexp(log_normal(right), log_normal(left))
    return np.minimum(np.where(still & (np.abs(m) == clearance), np.log(0.5), found), 0.0)


def guidance_part(log_fraction: ArrayLike, admissible: float) -> FloatArray:
    """Guidance from 0 (phi_G is `admissible`) to 1 (1e-6), even in the logarithm ln phi_G.

    Raises ValueError for an admissible share that is not above 1e-6 and at most 1.

    >>> import math
    >>> round(float(guidance_part(math.log(0.0455), 0.05)), 5)
    0.00872
    """
    if not LEAST_SHARE < admissible <= 1:
        raise ValueError(f"admissible_flange_fraction must be above {LEAST_SHARE:g} and at most 1: {admissible:g}")
    decades = np.log(admissible) - np.asarray(log_fraction, dtype=np.float64)
    return np.asarray(np.clip(decades / np.log(admissible / LEAST_SHARE), 0.0, 1.0), dtype=np.float64)
