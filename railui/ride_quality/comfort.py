"""The comfort point: what lies between the frame and the passenger, and the weightings behind it."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railui.arrays import FloatArray
from railui.dsp.discretise import discretise
from railui.ride_quality.weighting import (
    W_D,
    Analog,
    brick_wall_1974,
    cascade,
    comfort_cascades,
    masses_before,
    one_mass,
    weighted_rms,
)
from railui.vehicle.design import Riding
from railui.vehicle.model import Model

MINUTE: Final = 60.0  # s
HOUR: Final = 3600.0
DAY: Final = 24 * HOUR
REDUCED: Final = 3.15  # fatigue-decreased proficiency over reduced comfort
FEWEST_BLOCKS: Final = 60  # of 5 s: five minutes, EN 12299

# ISO 2631 of the 1970s, lateral, 1-2 Hz: time [s] against rms [m/s^2] of fatigue-decreased proficiency
ISO_2631_1974: Final = (
    *((24 * HOUR, 0.100), (16 * HOUR, 0.150), (8 * HOUR, 0.224), (4 * HOUR, 0.355), (2.5 * HOUR, 0.50)),
    *((1 * HOUR, 0.85), (25 * MINUTE, 1.25), (16 * MINUTE, 1.5), (1 * MINUTE, 2.0)),
)

COACH: Final = "coach centre, its own mass on spring and damper"
UNCHANGED: Final = np.array([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]])  # a section that passes everything
BARELY: Final = 1e-6  # share of critical damping of an undamped coach, for its transfer to exist


def floor_points(model: Model) -> tuple[str, ...]:
    """The names of the floor points that a vehicle of bodies and elements has."""
    structure = model.design.structure
    return () if structure is None else tuple(part.name for part in structure.floor)


def felt_acceleration(model: Model) -> tuple[str, ...]:
    """The channels of acceleration behind which comfort lies: the floor points, or the frame."""
    return tuple(f"floor.{name}" for name in floor_points(model)) or ("ayf",)


def carbody_of(model: Model) -> int | None:
    """Which effect puts a coach above the frame, None where there is none."""
    return next((i for i, e in enumerate(model.design.effects) if e.kind == "coach_mode"), None)


def floor_of(model: Model, row: FloatArray) -> Riding:
    """The riding settings of one row; a coach's own transfer, w0^2 = k/m and 2 z w0 = c/m, is the floor's.

    That is what a mass on spring and damper above the frame passes on of the frame's acceleration.
    """
    riding, number = model.design.riding, carbody_of(model)
    if number is None:
        return riding
    paths = (f"effects.{number}.{key}" for key in ("mass", "stiffness", "damping"))
    m, k, c = (float(row[model.columns[path]]) for path in paths)
    w0 = float(np.sqrt(k / m))
    return replace(riding, floor_frequency=w0 / (2 * np.pi), floor_damping=max(c / (2 * m * w0), BARELY))


def comfort_sections(model: Model, rows: FloatArray, dt: float) -> dict[str, FloatArray]:
    """Streaming filters [n, sections, 6] from the acceleration of frame or floor to each weighted one, `dt` [s] apart.

    Those of `comfort_cascades`, and for goods `acceleration`, which is not weighted.
    """
    ridings = [floor_of(model, row) for row in rows] if carbody_of(model) is not None else [model.design.riding]
    kinds = {riding: i for i, riding in enumerate(dict.fromkeys(ridings))}
    transfer = not floor_points(model)
    made = [_sections(riding, dt, transfer) for riding in kinds]
    pick = [kinds[riding] for riding in ridings] if len(kinds) > 1 else [0] * len(rows)
    return {name: np.stack([one[name] for one in made])[pick] for name in made[0]}


def _sections(riding: Riding, dt: float, transfer: bool) -> dict[str, FloatArray]:
    found = comfort_cascades(riding, dt, transfer)
    if riding.use == "goods":
        point = before(riding, transfer)
        found["acceleration"] = discretise(point, dt) if point.poles.size else UNCHANGED
    return found


def before(riding: Riding, transfer: bool = True) -> Analog:
    """The transfer to the comfort point, from the frame, or (not `transfer`) from the floor itself."""
    return cascade(*(one_mass(*mass) for mass in masses_before(riding, transfer)))


def reference(model: Model, acceleration: ArrayLike, dt: float) -> dict[str, float]:
    """Weighted accelerations [m/s^2] of the acceleration of frame or floor [samples] in the frequency domain.

    W_d and the brick wall of the 1970s at the comfort point, by the convention of `weighted_rms`: beside
    them stand the streaming forms.
    """
    point = before(floor_of(model, model.row), not floor_points(model))

    def wd(f: FloatArray) -> FloatArray:
        return point.modulus(f) * W_D.modulus(f)

    def wall(f: FloatArray) -> FloatArray:
        return point.modulus(f) * brick_wall_1974(f)

    return {
        "weighted_acceleration": weighted_rms(acceleration, dt, wd),
        "weighted_acceleration_1974": weighted_rms(acceleration, dt, wall),
    }


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


def comfort_part(time: ArrayLike) -> FloatArray:
    """Comfort from 0 (1 min) to 1 (24 h) at a comfort time [s], even in its logarithm.

    >>> round(float(comfort_part(4 * 3600.0)), 4)  # ln 240/ln 1440
    0.7536
    """
    share = np.log(np.asarray(time, dtype=np.float64) / MINUTE) / np.log(DAY / MINUTE)
    return _clamped(share)


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


def _clamped(share: FloatArray) -> FloatArray:
    return np.asarray(np.clip(share, 0.0, 1.0), dtype=np.float64)


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
