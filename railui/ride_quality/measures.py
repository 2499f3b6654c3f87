"""The parts of riding quality: times of comfort, shares of flange contact, ride values."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railui.arrays import FloatArray

MINUTE: Final = 60.0  # s
HOUR: Final = 3600.0
DAY: Final = 24 * HOUR
REDUCED: Final = 3.15  # fatigue-decreased proficiency over reduced comfort
LEAST_SHARE: Final = 1e-6  # of flange contact: better than this earns nothing
FAR_OUT: Final = -30.0  # standard deviations: erfc is 0 from -38 on
FEWEST_BLOCKS: Final = 60  # of 5 s: five minutes, EN 12299

# ISO 2631 of the 1970s, lateral, 1-2 Hz: time [s] against rms [m/s^2] of fatigue-decreased proficiency
ISO_2631_1974: Final = (
    *((24 * HOUR, 0.100), (16 * HOUR, 0.150), (8 * HOUR, 0.224), (4 * HOUR, 0.355), (2.5 * HOUR, 0.50)),
    *((1 * HOUR, 0.85), (25 * MINUTE, 1.25), (16 * MINUTE, 1.5), (1 * MINUTE, 2.0)),
)


def _clamped(share: FloatArray) -> FloatArray:
    return np.asarray(np.clip(share, 0.0, 1.0), dtype=np.float64)


def comfort_time(rms_1974: ArrayLike) -> FloatArray:
    """Time [s] before the reduced-comfort boundary at a weighted acceleration [m/s^2 rms, 1970s weighting].

    Log-log between the points of ISO 2631 over 3.15, from 1 min to 24 h: outside the table the end point
    stands.

    >>> round(float(comfort_time(0.355 / 3.15)) / 3600, 9)
    4.0
    """
    rms = np.asarray(rms_1974, dtype=np.float64)
    seconds, limits = np.array(ISO_2631_1974).T
    with np.errstate(divide="ignore"):
        logarithm = np.interp(np.log(rms), np.log(limits / REDUCED), np.log(seconds))
    return np.asarray(np.clip(np.exp(logarithm), MINUTE, DAY), dtype=np.float64)


def comfort_clipped(rms_1974: ArrayLike) -> NDArray[np.bool_]:
    """Whether a weighted acceleration [m/s^2] lies outside the table, beyond 24 h or 1 min.

    >>> bool(comfort_clipped(0.01)), bool(comfort_clipped(0.1))
    (True, False)
    """
    rms = np.asarray(rms_1974, dtype=np.float64)
    return (rms < ISO_2631_1974[0][1] / REDUCED) | (rms > ISO_2631_1974[-1][1] / REDUCED)


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


def comfort_part(time: ArrayLike) -> FloatArray:
    """Comfort from 0 (1 min) to 1 (24 h) at a comfort time [s], even in its logarithm.

    >>> round(float(comfort_part(4 * 3600.0)), 4)  # ln 240/ln 1440
    0.7536
    """
    share = np.log(np.asarray(time, dtype=np.float64) / MINUTE) / np.log(DAY / MINUTE)
    return _clamped(share)


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
    return _clamped(decades / np.log(admissible / LEAST_SHARE))


def goods_part(rms: ArrayLike, peak: ArrayLike | None, rms_limit: float, peak_limit: float | None) -> FloatArray:
    """What goods have instead of comfort: 1 - rms/limit or, if that is less, 1 - peak/limit, 0 to 1.

    Accelerations [m/s^2] where the load lies. Raises ValueError where a peak limit is set and no peak is
    given.

    >>> float(goods_part(0.5, 3.0, 2.0, 4.0))
    0.25
    """
    share = 1 - np.asarray(rms, dtype=np.float64) / rms_limit
    if peak_limit is not None:
        if peak is None:
            raise ValueError(f"riding.peak_limit is {peak_limit:g} m/s^2, but the statistics hold no peak")
        share = np.minimum(share, 1 - np.asarray(peak, dtype=np.float64) / peak_limit)
    return _clamped(share)


def ride_value(rms_sperling: ArrayLike) -> FloatArray:
    """Sperling's Wz = 4.42 (rms [m/s^2] of the acceleration weighted with B)^0.3.

    >>> round(float(ride_value(0.2)), 4)
    2.7273
    """
    return np.asarray(4.42 * np.asarray(rms_sperling, dtype=np.float64) ** 0.3, dtype=np.float64)


def n_mv(block_rms: ArrayLike) -> float | None:
    """Mean comfort 6 a95, its lateral part: a95 the 95th percentile of the W_d rms [m/s^2] of 5 s blocks.

    None under 60 blocks. EN 12299 adds the vertical and longitudinal axes, which a lateral model does not
    know.

    >>> n_mv([0.1] * 59) is None, round(n_mv([0.1] * 60), 9)
    (True, 0.6)
    """
    blocks = np.asarray(block_rms, dtype=np.float64)
    if blocks.size < FEWEST_BLOCKS or not np.all(np.isfinite(blocks)):
        return None
    return 6.0 * float(np.percentile(blocks, 95))
