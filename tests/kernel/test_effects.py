"""Every effect at every location of a bogie, alone and combined, verified against the independent generator."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from railui import core
from railui.core import Placement
from tests.kernel.pairs import (
    ROUNDING,
    assert_same,
    asymmetric_bogie,
    batch,
    change,
    effect_locations,
    interval,
    kernel,
    table,
    tangent_run,
    with_coach_forces,
)
from tests.truth.effects import KINDS, effect, parse
from tests.truth.march import simulate, simulate_many

# usual motion and speed at a place, and a stiffness of the order of what is there
USUAL = {
    "secondary_lateral": (4e-3, 0.05, 4e5),
    "secondary_yaw": (1e-3, 0.02, 2e6),
    "primary_lateral": (5e-4, 0.02, 6e6),
    "primary_yaw": (3.5e-4, 8e-3, 16e6),
    "wheelset": (4e-3, 0.05, 1e6),
    "wheelset_yaw": (1e-3, 0.02, 4e6),
    "frame": (4e-3, 0.05, 4e5),
    "frame_yaw": (1e-3, 0.02, 2e6),
    "contact": (2e-3, 0.05, 2e6),
    "track": (1e-4, 1e-3, 2e7),
}
CURVE = ([-1.5, -0.4, 0.3, 1.2], [0.6, 0.25, -0.1, -0.7])
# ends inside the motion, so that the straight lines beyond them are used too
GRID = np.linspace(-3e-3, 3.5e-3, 14)
SHAPE = {
    "displacement": GRID.tolist(),
    "radius": (GRID + 4e4 * GRID**3 + 30.0 * GRID**2).tolist(),
    "radius_per_gauge": (-60.0 * GRID + 2e3 * GRID**2).tolist(),
    "angle": (0.8 * GRID + 3e4 * GRID**3).tolist(),
}


def strong_effect(kind: str, at: str) -> dict[str, Any]:
    """Parameters in the size of what happens at a place: strong, and no stiffer than one step per sample bears."""
    z, v, k = USUAL[at]
    words: dict[str, dict[str, Any]] = {
        "flange_contact": {"clearance": 0.5 * z, "stiffness": 14.6e6},
        "measured_force": {"motion": [x * z for x in CURVE[0]], "force": [x * k * z for x in CURVE[1]]},
        "creep_saturation": {"friction": 0.15},
        "vermeulen_johnson": {"friction": 0.15, "longitudinal_factor": 1.2, "lateral_factor": 1.1},
        "shen_hedrick_elkins": {"friction": 0.15, "surface": 0.6},
        "polach": {
            "friction": 0.2,
            "adhesion_reduction": 0.8,
            "slip_reduction": 0.4,
            "friction_ratio": 0.4,
            "friction_decay": 0.6,
        },
        "profile_shape": SHAPE,
        "nonlinear_conicity": {"cubic": 2e4},
        "gauge_conicity": {"per_gauge": -15.0},
        "rolling_line_offset": {"offset": 1.5e-3},
        # bends where the run is, so that the wheelsets see them one after the other
        "rolling_line": {"place": [5.0, 22.0, 31.0, 47.0], "offset": [0.0, 2e-3, -1e-3, 1.5e-3]},
        "rail_flexibility": {"stiffness": 2e7, "damping": 1e5},
        "coach_mode": {"mass": 1.5e4, "stiffness": 3e5, "damping": 2e4},
    }
    assert kind in KINDS, f"{kind} is new in the catalogue: it needs a law in tests/truth/laws.py and an entry of KINDS"
    example = KINDS[kind].example
    return words[kind] if example is None else example(z, v, k)


RUN, VEHICLE = tangent_run(1.5), asymmetric_bogie(11)


@cache
def truths(kind: str) -> dict[tuple[str, int | None], dict[str, Any]]:
    """The generator's answer for a kind at all its places, in one batch."""
    places = [(at, wheelset) for _, at, wheelset in effect_locations([kind])]
    effects = [[effect(kind, at, wheelset, **strong_effect(kind, at))] for at, wheelset in places]
    found = simulate_many([VEHICLE] * len(places), [RUN] * len(places), effects, 1)
    return dict(zip(places, found, strict=True))


@pytest.mark.parametrize(("kind", "at", "wheelset"), list(effect_locations()))
def test_an_effect_moves_the_bogie_as_it_moves_the_generator_s(kind: str, at: str, wheelset: int | None) -> None:
    found = kernel(VEHICLE, RUN, [effect(kind, at, wheelset, **strong_effect(kind, at))])
    assert change(found, kernel(VEHICLE, RUN)) > 1e-3
    assert_same(found, truths(kind)[at, wheelset], ROUNDING)


def test_the_generator_and_the_kernel_have_the_same_kinds_of_effects() -> None:
    assert {r["kind"] for r in core.effect_catalogue()} == {kind for kind, known in KINDS.items() if known.catalogued}


# ------------------------------------------------------------------------------------------------ effects together

SECONDARY = "maxwell_damper at=secondary_yaw stiffness=2e6 damping=4e4"
COACH = "coach_mode at=secondary_lateral mass=15e3 stiffness=3e5 damping=2e4"
FLANGE = "flange_contact at=contact clearance=0.002 stiffness=14.6e6"
RUBBING = f"{FLANGE} friction=0.3 depth=0.012 angle=1.2"
LUBRICATED = f"{FLANGE} friction=0.1"
SLIP = "creep_saturation at=contact friction=0.15"
RAIL = "rail_flexibility at=track stiffness=2e7 damping=1e5"
CONTACT = (
    "gauge_conicity at=contact per_gauge=-15",
    "nonlinear_conicity at=contact wheelset=1 cubic=2e4",
    "rolling_line_offset at=contact wheelset=2 offset=0.001",
)
PROFILES = " ".join(
    ["profile_shape at=contact", *(f"{k}={','.join(map(repr, map(float, v)))}" for k, v in SHAPE.items())]
)
TOGETHER = {
    "friction_below_a_coach": (COACH, "dry_friction at=secondary_lateral force=800 slip_speed=0.02"),
    "stop_and_damper_below_a_coach": (
        "maxwell_damper at=secondary_lateral stiffness=1e6 damping=3e4",
        COACH,
        "bump_stop at=secondary_lateral gap=0.002 stiffness=1e6",
    ),
    "each_wheelset_on_its_own_friction": (
        "creep_saturation at=contact wheelset=1 friction=0.1",
        "creep_saturation at=contact wheelset=2 friction=0.3",
    ),
    "rail_and_flange": (RAIL, FLANGE),
    "flange_with_friction": (RUBBING,),
    "lubricated_flange_of_one_wheelset": (SLIP, f"{FLANGE} wheelset=2", f"{LUBRICATED} wheelset=1"),
    "rail_saturation_and_flange_with_friction": (RAIL, SLIP, RUBBING),
    "profiles_and_a_flange_with_friction": (SLIP, RUBBING, *CONTACT, PROFILES),
    "rail_and_saturation": (RAIL, SLIP),
    "rail_under_one_wheelset_and_saturation": ("rail_flexibility at=track wheelset=1 stiffness=2e7 damping=1e5", SLIP),
    "soft_rail_and_sliding_wheels": (
        "rail_flexibility at=track stiffness=5e6 damping=1e4",
        "creep_saturation at=contact friction=0.05",
    ),
    "rail_saturation_and_flange": (RAIL, SLIP, FLANGE),
    "the_whole_contact": (RAIL, SLIP, FLANGE, *CONTACT),
    "rail_under_wheels_of_polach": (
        RAIL,
        "polach at=contact friction=0.1 slip_reduction=0.4 friction_ratio=0.4 friction_decay=0.6",
    ),
    "soft_rail_under_falling_friction": (
        "rail_flexibility at=track stiffness=5e6 damping=3e4",
        "polach at=contact friction=0.05 slip_reduction=0.4 friction_ratio=0.4 friction_decay=1.5",
    ),
    "rail_under_creep_steeper_than_linear": (
        RAIL,
        "vermeulen_johnson at=contact friction=0.15 longitudinal_factor=1.2 lateral_factor=1.3",
    ),
    "profiles_and_the_whole_contact": (RAIL, SLIP, FLANGE, *CONTACT, PROFILES),
    "twice_the_same": (
        "dry_friction at=secondary_lateral force=500 slip_speed=0.03",
        "dry_friction at=secondary_lateral force=300 slip_speed=0.01",
    ),
    "linkage": ("spring at=wheelset_yaw stiffness=2e6", "viscous_damper at=wheelset_yaw damping=2e4"),
    "a_whole_vehicle": (
        FLANGE,
        SLIP,
        *CONTACT,
        "hysteresis at=primary_lateral stiffness=3e6 yield=800",
        "free_play at=primary_yaw wheelset=2 half_width=1e-4",
        "spring at=wheelset_yaw stiffness=2e6",
        "run_out at=wheelset wheelset=1 force=1000 rolling_radius=0.461 phase=1",
        "steady_force at=frame force=500",
        "dry_friction at=secondary_lateral force=500 slip_speed=0.03",
        SECONDARY,
    ),
}


@cache
def truths_together() -> dict[str, dict[str, Any]]:
    effects = [[parse(word) for word in words] for words in TOGETHER.values()]
    found = simulate_many([VEHICLE] * len(effects), [RUN] * len(effects), effects, 2)
    return dict(zip(TOGETHER, found, strict=True))


@pytest.mark.parametrize("name", list(TOGETHER))
def test_effects_together_move_the_bogie_as_they_move_the_generator_s(name: str) -> None:
    effects = [parse(word) for word in TOGETHER[name]]
    found = kernel(VEHICLE, RUN, effects, 2)
    assert_same(found, truths_together()[name], ROUNDING)
    plain = kernel(VEHICLE, RUN, steps=2)
    for i in range(len(effects)):
        without = kernel(VEHICLE, RUN, effects[:i] + effects[i + 1 :], 2)
        assert change(found, without) > 1e-3, f"{effects[i].kind} does nothing here"
    assert change(found, plain) > 1e-3


@pytest.mark.parametrize("other", ["", " wheelset=1"])
def test_a_wheelset_has_one_rail(other: str) -> None:
    with pytest.raises(ValueError, match="rail_flexibility and rail_flexibility both take the place of the same"):
        kernel(VEHICLE, RUN, [parse(RAIL), parse(f"rail_flexibility at=track{other} stiffness=1e7 damping=2e5")])


def test_a_curve_has_motions_that_rise() -> None:
    for motion in ([0.0, 0.0], [0.01, -0.01]):
        curve = {"motion": motion, "force": [0.0, 1e3]}
        with pytest.raises(ValueError, match="measured_force"):
            kernel(VEHICLE, RUN, [effect("measured_force", "frame", None, **curve, against="z")])


def test_a_number_that_is_nan_is_refused() -> None:
    with pytest.raises(ValueError, match="spring is NaN, it must be a number"):
        kernel(VEHICLE, RUN, [effect("spring", "primary_lateral", None, stiffness=float("nan"))])


def test_a_curve_against_speed_is_read_at_the_speed() -> None:
    places = [(at, wheelset) for _, at, wheelset in effect_locations(["measured_force"]) if wheelset != 2]
    effects = []
    for at, wheelset in places:
        z, v, k = USUAL[at]
        curve = {"motion": [x * v for x in CURVE[0]], "force": [0.5 * x * k * z for x in CURVE[1]]}
        effects.append(effect("measured_force", at, wheelset, **curve, against="v"))
    found = simulate_many([VEHICLE] * len(places), [RUN] * len(places), [[e] for e in effects], 1)
    for one, truth in zip(effects, found, strict=True):
        assert_same(kernel(VEHICLE, RUN, [one]), truth, ROUNDING)
        assert change(truth, kernel(VEHICLE, RUN)) > 1e-3


def test_a_curve_against_the_distance_is_a_coach_force_that_was_measured_along_it() -> None:
    run = with_coach_forces(tangent_run(3.0), 3e3)
    assert run.Qy is not None
    grid = np.arange(run.s[0], run.s[-1] + 0.04, 0.05)
    force = 3e3 * np.sin(2.0 * np.pi * grid / 31.0 + 0.4)
    numbers = core.effect_numbers("measured_force", {"motion": grid, "force": force})
    bare = batch([asymmetric_bogie(3)])
    bare.numbers[
        0, [core.parameter_paths("bogie").index(f"vehicle.secondary.lateral_{x}") for x in ("stiffness", "damping")]
    ] = 0.0
    made = core.Vehicles("bogie", [Placement("measured_force", "frame", None, len(numbers), "s")])
    one = core.Batch.from_arrays(bare.numbers, np.array([numbers]), np.ones((1, 1)))
    run_0 = tangent_run(3.0)
    found, _ = made.simulate(one, table(run_0, asymmetric_bogie(3).a, 2), interval(run), 2, ["e1", "ayf"])
    truth = simulate(asymmetric_bogie(3), run, steps=2)
    # linear between points 0.05 m apart: (2 pi 0.05/31)^2/8 = 1.3e-5 of the force
    assert_same(dict(zip(("e1", "ayf"), found[0], strict=True)), truth, 1e-4)


# ------------------------------------------------------------------------------------------------- a valve that opens


@pytest.mark.parametrize(
    "word",
    [
        "maxwell_damper at=secondary_yaw stiffness=5e6 damping=1e5 blow_off=800",
        "maxwell_damper at=primary_yaw wheelset=1 stiffness=16e6 damping=7e5 blow_off=2000",
    ],
)
def test_a_blown_off_damper_comes_back_in_time(word: str) -> None:
    # with the force held but not the damper's state, the error was of first order: 6e-4 here
    run, one = tangent_run(1.0), [parse(word)]
    free = [effect(one[0].kind, one[0].at, one[0].wheelset, **{**one[0].parameters, "blow_off": 1e9})]
    truth = simulate(VEHICLE, run, one, 16)
    found = kernel(VEHICLE, run, one, 8)
    assert change(found, kernel(VEHICLE, run, free, 8)) > 1e-2
    assert_same({"e1": found["e1"], "psi1": found["psi1"]}, truth, 1e-4)
