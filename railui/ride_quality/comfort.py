"""The comfort point: what lies between the frame and the passenger, and the weightings behind it."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

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
