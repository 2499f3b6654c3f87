"""Guidance: share of flange contact of a Gaussian displacement, and the guidance index of the score."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray

MIN_FLANGE_FRACTION: Final = 1e-6  # share of flange contact below which guidance does not improve any more
ASYMPTOTIC_BELOW: Final = -30.0  # standard deviations below which the asymptotic series is used; erfc is 0 below -38


def log_ndtr(x: ArrayLike) -> FloatArray:
    """Return ln Phi(x), the logarithm of the normal distribution, accurate far out in its lower tail.

    By erfc, and below -30 by the asymptotic series of Mills' ratio. The same as scipy.special.log_ndtr, whose import
    would take a quarter of a second of every ride. Source: Abramowitz, Stegun, 26.2.12.

    >>> log_ndtr([-100.0, 0.0, 8.0]).round(6).tolist()
    [-5005.524209, -0.693147, -0.0]
    """
    z = np.asarray(x, dtype=np.float64)
    in_tail = z < ASYMPTOTIC_BELOW
    share = _erfc(np.abs(np.where(in_tail, 0.0, z)) / np.sqrt(2.0)) / 2.0
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        by_erfc = np.where(z > 0, np.log1p(-share), np.log(share))
        u = -np.where(in_tail, z, ASYMPTOTIC_BELOW)
        u2 = u**2
        series = 1.0 - (1.0 - (3.0 - (15.0 - (105.0 - 945.0 / u2) / u2) / u2) / u2) / u2
        asymptotic = -0.5 * u2 - np.log(u) - 0.5 * np.log(2.0 * np.pi) + np.log(series)
    return np.asarray(np.where(in_tail, asymptotic, by_erfc), dtype=np.float64)


_erfc: Final = np.vectorize(math.erfc, otypes=[np.float64])


def log_flange_fraction_gaussian(mean: ArrayLike, sd: ArrayLike, clearance: float) -> FloatArray:
    """Return ln phi_G, the logarithm of the share of time with abs(e) >= clearance of a Gaussian displacement e.

    phi_G = 1/2 erfc((c - m)/(sqrt2 sd)) + 1/2 erfc((c + m)/(sqrt2 sd)), accurate far out in the tails; -inf if sd is
    0 and the mean lies inside the clearance.

    Parameters
    ----------
    mean, sd : array_like
        Mean and standard deviation of the displacement [m].
    clearance : float
        Flange clearance [m].

    References
    ----------
    Broersen 1974.

    Examples
    --------
    >>> round(float(log_flange_fraction_gaussian(0.0, 1e-4, 7e-3)), 1)
    -2454.5
    """
    m, s = np.broadcast_arrays(np.asarray(mean, dtype=np.float64), np.asarray(sd, dtype=np.float64))
    is_constant = s == 0
    with np.errstate(over="ignore"):
        right = (m - clearance) / np.where(is_constant, 1.0, s)
        left = (-m - clearance) / np.where(is_constant, 1.0, s)
        right = np.where(is_constant, np.where(m > clearance, np.inf, -np.inf), right)
        left = np.where(is_constant, np.where(-m > clearance, np.inf, -np.inf), left)
    with np.errstate(invalid="ignore"):
        log_fraction = np.logaddexp(log_ndtr(right), log_ndtr(left))
    return np.minimum(np.where(is_constant & (np.abs(m) == clearance), np.log(0.5), log_fraction), 0.0)


def guidance_index(log_fraction: ArrayLike, admissible: float) -> FloatArray:
    """Return the guidance index: 0 at phi_G = `admissible`, 1 at phi_G = 1e-6, linear in ln phi_G and clipped.

    Parameters
    ----------
    log_fraction : array_like
        ln phi_G, see `log_flange_fraction_gaussian`.
    admissible : float
        Admissible share of flange contact.

    Raises
    ------
    ValueError
        For an admissible share that is not above 1e-6 and at most 1.

    Examples
    --------
    >>> import math
    >>> round(float(guidance_index(math.log(0.0455), 0.05)), 5)
    0.00872
    """
    if not MIN_FLANGE_FRACTION < admissible <= 1:
        raise ValueError(
            f"admissible_flange_fraction must be above {MIN_FLANGE_FRACTION:g} and at most 1: {admissible:g}"
        )
    distance = np.log(admissible) - np.asarray(log_fraction, dtype=np.float64)
    index = np.clip(distance / np.log(admissible / MIN_FLANGE_FRACTION), 0.0, 1.0)
    return np.asarray(index, dtype=np.float64)


def flange_margin(mean: FloatArray, sd: FloatArray, clearance: float) -> FloatArray:
    """Return the least distance of abs(mean) from the clearance in standard deviations; infinite where sd is 0.

    >>> float(flange_margin(np.array([1e-3, 0.0]), np.array([2e-3, 1e-3]), 7e-3))
    3.0
    """
    distance = clearance - mean
    if_constant = np.where(distance == 0, 0.0, np.copysign(np.inf, distance))
    return np.asarray(np.min(np.where(sd > 0, distance / np.where(sd > 0, sd, 1.0), if_constant), axis=-1))
