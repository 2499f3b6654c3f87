"""Running safety of a ride: guiding forces, Y/Q, wheel unloading and lift against their limits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import LANES
from railui.ride_quality.guiding_forces import (
    MEAN_LENGTH,
    RMS_WINDOW,
    GuidingForces,
    characteristic_quotients,
    characteristic_values,
    guiding_force_channels,
    sliding_mean,
)
from railui.ride_quality.safety_criteria import Criterion, criteria_of
from railui.ride_quality.safety_limits import QUOTIENT_LIMIT, SafetyLimits, creep_friction_of
from railui.track.excitation import Excitation
from railui.vehicle.model import Model
from railui.vehicle.on_track import on_rails, spacings, vehicles_on

__all__ = [
    "QUOTIENT_LIMIT",
    "SAFETY_KEYS",
    "Criterion",
    "GuidingForces",
    "RunningSafety",
    "characteristic_values",
    "criteria_of",
    "guiding_force_channels",
    "model_notes",
    "running_safety",
    "running_safety_many",
    "safety_of",
    "sliding_mean",
]

STATIC_LOAD_NOTE: Final = "an indication: this model is planar, its wheels bear their static load"
QUASI_STATIC_NOTE: Final = "load transfer quasi-static in roll; vertical irregularities are left out"
NO_FLANGE_NOTE: Final = "forces: the design has no flange_contact, nothing limits e: they are those of the tread only"
NO_FRICTION_NOTE: Final = "forces: the design has no creep law with friction, its creep forces grow without bound"
NO_ANGLE_NOTE: Final = "Y/Q: against 0.8 only, without contact.profiles the flange angle of Nadal's limit is unknown"
LIFT_NOTE: Final = "Y/Q: a wheel is wholly unloaded in places, where it has none"


@dataclass(frozen=True, eq=False)
class RunningSafety:
    """Running safety of one ride."""

    forces: GuidingForces
    limits: SafetyLimits
    criteria: tuple[Criterion, ...]
    model_notes: tuple[str, ...]

    @property
    def findings(self) -> list[tuple[str, str]]:
        """Exceeded limits: best class, and reason."""
        return [each.finding for each in self.criteria if each.is_exceeded]

    @property
    def safety_share(self) -> float:
        """Largest value over its limit of all criteria; at least 1 if a wheel lifts."""
        shares = [each.share for each in self.criteria if each.share is not None]
        lifted = [1.0 + each.value for each in self.criteria if each.key == "wheel_lift"]
        return max(shares + lifted)

    def measures(self) -> dict[str, float | None]:
        """Return the criteria as numbers of the ride: values by key, None where one is undefined."""
        values = {each.key: each.value for each in self.criteria}
        return {name: values.get(key) for name, key in MEASURES.items()} | {"safety_share": self.safety_share}

    def notes(self) -> list[str]:
        """Return notes on the meaning of the figures."""
        notes = [
            (self.limits.nadal is None, NO_ANGLE_NOTE),
            (bool(self.forces.is_lifted.any()), LIFT_NOTE),
            (not self.forces.rms.size, f"rms_100m: null, the track is shorter than {RMS_WINDOW:g} m"),
        ]
        return [*self.model_notes, *(text for applies, text in notes if applies)]

    def as_dict(self) -> dict[str, Any]:
        """Return the value of the result key `forces`."""
        forces, total = self.forces, np.abs(self.forces.total)
        quotients = characteristic_quotients(forces.quotient)
        wheels, sums = characteristic_values(forces.wheels), characteristic_values(total)
        unloading = characteristic_values(forces.unloading)
        wheelsets = [
            {
                "sum_of_guiding_forces": float(sums[i]),
                "limit": float(limit),
                "share_above_limit": float(np.mean(total[i] > limit)),
                "rms_100m": float(forces.rms[i].max()) if forces.rms.size else None,
                "dominant_frequency": _finite(forces.dominant_frequency[i]),
                "guiding_force": wheels[i].tolist(),
                "derailment_quotient": [_finite(q) for q in quotients[i]],
                "wheel_unloading": unloading[i].tolist() if self.limits.has_load_transfer else None,
            }
            for i, limit in enumerate(forces.limit)
        ]
        is_defined = np.isfinite(quotients)
        return {
            "wheelsets": wheelsets,
            "derailment_quotient": float(quotients[is_defined].max()) if is_defined.any() else None,
            "derailment_quotient_limit": self.limits.quotient,
            "nadal_limit": self.limits.nadal,
            "weinstock_limit": self.limits.weinstock,
            "flange_angle": self.limits.flange_angle,
            "friction": self.limits.friction,
            "load_transfer": self.limits.has_load_transfer,
            "criteria": [each.as_dict() for each in self.criteria],
            "notes": self.notes(),
        }


MEASURES: Final = {
    "largest_sum_of_guiding_forces": "sum_of_guiding_forces",
    "largest_derailment_quotient": "derailment_quotient",
    "largest_rms_100m": "rms_100m",
    "largest_wheel_unloading": "wheel_unloading",
}
SAFETY_KEYS: Final = (*MEASURES, "safety_share")


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def running_safety(model: Model, excitation: Excitation, jobs: int | None = 1) -> RunningSafety | None:
    """Compute guiding forces of a ride and compare them with their limits.

    Returns
    -------
    RunningSafety or None
        `as_dict()` is the result key `forces`. None if the vehicle diverges or the track is shorter than 4 m.
    """
    steps = model.vehicles().required_steps(model.single_batch(), excitation.speed, excitation.speed, excitation.dt)
    return running_safety_many([model], excitation, np.array(steps), jobs)[0]


def running_safety_many(
    models: Sequence[Model], excitation: Excitation, steps: NDArray[np.int64], jobs: int | None = None
) -> list[RunningSafety | None]:
    """Return the running safety of n vehicles of one structure on one track; `steps` [n] RK4 steps per sample."""
    spacing, rate = excitation.track.spacing, 1.0 / excitation.dt
    results: list[RunningSafety | None] = [None] * len(models)
    if excitation.track.length < 2 * MEAN_LENGTH:
        return results
    for i, series in _force_series(models, excitation, steps, jobs):
        forces = GuidingForces.from_series(models[i], series, rate, spacing)
        results[i] = safety_of(models[i], forces, excitation.track.s)
    return results


def safety_of(model: Model, forces: GuidingForces, s: FloatArray, first: int = 0) -> RunningSafety:
    """Return the running safety of guiding forces on a track s [sample] in m, from sample `first` on."""
    limits = SafetyLimits.of(model)
    criteria = tuple(criteria_of(forces, limits, s, first))
    return RunningSafety(forces, limits, criteria, tuple(model_notes(model)))


def model_notes(model: Model) -> list[str]:
    """Return notes on what the guiding forces and wheel loads of a model can and cannot show."""
    limits = SafetyLimits.of(model)
    notes = [f"Y/Q: {QUASI_STATIC_NOTE if limits.has_load_transfer else STATIC_LOAD_NOTE}"]
    notes += [] if limits.has_flange else [NO_FLANGE_NOTE]
    return notes + friction_notes(model)


def friction_notes(model: Model) -> list[str]:
    """Return a note on creep forces that no friction limits."""
    return [] if creep_friction_of(model) is not None else [NO_FRICTION_NOTE]


def _force_series(
    models: Sequence[Model], excitation: Excitation, steps: NDArray[np.int64], jobs: int | None
) -> Iterator[tuple[int, FloatArray]]:
    """Yield the number and the series [channel, sample] of each vehicle that stays on the track."""
    vehicles, channels = vehicles_on(models[0], excitation), guiding_force_channels(models[0])
    groups: dict[tuple[Any, int], list[int]] = {}
    keys = spacings(models[0], np.stack([model.row for model in models]), excitation)
    for i, key in enumerate(keys):
        groups.setdefault((key, int(steps[i])), []).append(i)
    for (spacing, n), members in groups.items():
        table = excitation.table(spacing, n)
        for start in range(0, len(members), LANES):
            part = members[start : start + LANES]
            batch = on_rails(models[0], models[0].batch(np.stack([models[i].row for i in part])), excitation)
            series, diverged = vehicles.simulate(batch, table, excitation.dt, n, channels, jobs=jobs)
            yield from ((i, series[k]) for k, i in enumerate(part) if diverged[k] < 0)
