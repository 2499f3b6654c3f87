"""Integration error of the kernel over the number of steps, per vehicle and kind of effect.

Every vehicle runs over the same 200 m with 1, 2, 4, ... RK4 steps per sample and with 64 as the reference: there the
kernel agrees with DOP853 to 1e-7 and better (tests/kernel/test_reference.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.bench.designs import BOGIE
from railui.core import CURVE_KINDS, effect_catalogue
from railui.ride_quality.evaluation import excitation_of
from railui.track.excitation import Excitation
from railui.vehicle.design_reader import Design, parse_design
from railui.vehicle.manchester_coach import COACH
from railui.vehicle.model import Model
from railui.vehicle.simulate import simulate_series

STEP_COUNTS: Final = (1, 2, 4, 8)  # per sample
REFERENCE_STEPS: Final = 64
TRACK: Final = "erri_b176_high length=200 seed=1"
SPEED: Final = 40.0  # m/s
CHANNEL: Final = "e1"
NO_EFFECTS: Final = "none"
CONSTANT_KIND: Final = "steady_force"
SPRINGS: Final = "lateral_stiffness: 0.2e6, yaw_stiffness: 0.2e6"  # to which the defaults of many effects are relative
PREFERRED_LOCATION: Final = "primary_lateral"  # of an effect that is possible there, else its first location


def effect_cases() -> Iterator[tuple[str, str, Design]]:
    """Yield vehicle, effect, design: the standard bogie with each kind alone and with its own effects, and the coach.

    Omitted are sensors, which act after the run, measured curves and constant forces.
    """
    bogie, coach = parse_design(BOGIE, "bogie"), parse_design(COACH, "coach")
    bare = BOGIE.partition("effects:")[0].replace("secondary: {", f"secondary: {{{SPRINGS}, ")
    yield "bogie", NO_EFFECTS, parse_design(bare, "bogie")
    for record in effect_catalogue():
        if record["acts"] in ("sensor", "profile") or record["kind"] in (*CURVE_KINDS, CONSTANT_KIND):
            continue
        at = PREFERRED_LOCATION if PREFERRED_LOCATION in record["at"] else record["at"][0]
        yield "bogie", record["kind"], parse_design(f"{bare}effects: [{{kind: {record['kind']}, at: {at}}}]\n", "bogie")
    yield "bogie", _kinds(bogie), bogie
    yield "coach", NO_EFFECTS, coach.with_effects(())
    yield "coach", _kinds(coach), coach


def _kinds(design: Design) -> str:
    return ", ".join(effect.kind for effect in design.effects)


def step_errors() -> dict[str, Any]:
    """Compute the integration error of all cases: vehicle, effects, required steps per sample, errors by step count.

    The error is the rms of the difference of e_1 over the rms of e_1; None for a vehicle that diverges.
    """
    excitation = excitation_of(TRACK, SPEED)
    return {
        "track": excitation.source.name,
        "speed": SPEED,
        "channel": CHANNEL,
        "steps": list(STEP_COUNTS),
        "truth": REFERENCE_STEPS,
        "rows": [
            {"vehicle": vehicle, "effects": effects, **errors(Model(design), excitation)}
            for vehicle, effects, design in effect_cases()
        ],
    }


def errors(model: Model, excitation: Excitation) -> dict[str, Any]:
    """Return the required steps and the errors [step count] of a vehicle on a track."""
    exact = _displacement(model, excitation, REFERENCE_STEPS)
    size = float(np.sqrt(np.mean(exact**2)))
    differences = [_displacement(model, excitation, n) - exact for n in STEP_COUNTS]
    relative = [float(np.sqrt(np.mean(difference**2))) / size for difference in differences]
    taken = model.vehicles().required_steps(model.single_batch(), excitation.speed, excitation.speed, excitation.dt)[0]
    return {"taken": taken, "errors": [error if np.isfinite(error) else None for error in relative]}


def _displacement(model: Model, excitation: Excitation, steps: int) -> FloatArray:
    """Return e_1 [sample] in m; NaN for a vehicle that diverges."""
    series, diverged_at = simulate_series(model, excitation, [CHANNEL], steps=steps)
    return series[0] if diverged_at is None else np.full_like(series[0], np.nan)
