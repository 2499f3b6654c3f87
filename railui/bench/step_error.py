"""Work and precision: what a step of the kernel is wrong by, per vehicle and kind of effect.

Every vehicle rides the same 200 m with 1, 2, 4, ... steps of RK4 per sample and with 64, which stand for the truth: the
kernel agrees there with DOP853 to 1e-7 and better (tests/kernel/test_reference.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.bench.designs import BOGIE, COACH
from railui.core import CURVE_KINDS, effect_catalogue
from railui.ride_quality.evaluation import excitation_of
from railui.track.excitation import Excitation
from railui.vehicle.design_reader import Design, parse_design
from railui.vehicle.model import Model
from railui.vehicle.simulate import simulate_series

STEP_COUNTS: Final = (1, 2, 4, 8)  # per sample
TRUTH: Final = 64
TRACK: Final = "erri_b176_high length=200 seed=1"
SPEED: Final = 40.0  # m/s
CHANNEL: Final = "e1"
WITHOUT: Final = "none"
CONSTANT: Final = "steady_force"
SPRINGS: Final = "lateral_stiffness: 0.2e6, yaw_stiffness: 0.2e6"  # what the defaults of many effects are shares of
AT: Final = "primary_lateral"  # where an effect stands that can stand there, else at its first place


def effect_cases() -> Iterator[tuple[str, str, Design]]:
    """Vehicle, effect, design: the bogie of the standard job with each kind alone, then its own effects, the coach too.

    Left out are sensors, which act after the run, curves that measurements give, and what is constant.
    """
    bogie, coach = parse_design(BOGIE, "bogie"), parse_design(COACH, "coach")
    bare = BOGIE.partition("effects:")[0].replace("secondary: {", f"secondary: {{{SPRINGS}, ")
    yield "bogie", WITHOUT, parse_design(bare, "bogie")
    for record in effect_catalogue():
        if record["acts"] in ("sensor", "profile") or record["kind"] in (*CURVE_KINDS, CONSTANT):
            continue
        at = AT if AT in record["at"] else record["at"][0]
        yield "bogie", record["kind"], parse_design(f"{bare}effects: [{{kind: {record['kind']}, at: {at}}}]\n", "bogie")
    yield "bogie", _own(bogie), bogie
    yield "coach", WITHOUT, coach.with_effects(())
    yield "coach", _own(coach), coach


def _own(design: Design) -> str:
    return ", ".join(effect.kind for effect in design.effects)


def step_errors() -> dict[str, Any]:
    """Rows of vehicle, effects, steps per sample that the kernel takes by itself, and the error at each count of steps.

    The error is the rms of the difference of e_1 over the rms of e_1; None where the vehicle diverges.
    """
    road = excitation_of(TRACK, SPEED)
    return {
        "track": road.source.name,
        "speed": SPEED,
        "channel": CHANNEL,
        "steps": list(STEP_COUNTS),
        "truth": TRUTH,
        "rows": [
            {"vehicle": vehicle, "effects": effects, **errors(Model(design), road)}
            for vehicle, effects, design in effect_cases()
        ],
    }


def errors(model: Model, road: Excitation) -> dict[str, Any]:
    """The steps that the kernel takes, and the errors [count of steps] of a vehicle on a road."""
    exact = _ridden(model, road, TRUTH)
    size = float(np.sqrt(np.mean(exact**2)))
    found = [float(np.sqrt(np.mean((_ridden(model, road, n) - exact) ** 2))) / size for n in STEP_COUNTS]
    taken = model.vehicles().required_steps(model.single_batch(), road.speed, road.speed, road.dt)[0]
    return {"taken": taken, "errors": [error if np.isfinite(error) else None for error in found]}


def _ridden(model: Model, road: Excitation, steps: int) -> FloatArray:
    series, lost = simulate_series(model, road, [CHANNEL], steps=steps)
    return series[0] if lost is None else np.full_like(series[0], np.nan)
