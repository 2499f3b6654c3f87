"""Steps per sample: as many as a case needs by itself, enough for stiff laws, and a plain word where too many."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from railui import core
from tests.kernel.pairs import (
    apart,
    batch,
    enough,
    interval,
    kernel,
    straight,
    structure,
    table,
    uneven,
)
from tests.truth.effects import effect, parse
from tests.truth.tracks import eased, met

VEHICLE = uneven(40)
RUN = straight(2.0)


def test_the_steps_of_a_case_are_not_raised_by_its_neighbours() -> None:
    stiff = replace(VEHICLE, c_x=200e6)
    made, t = structure(VEHICLE), interval(RUN)
    few, many = (made.steps(batch([v]), 40.0, 40.0, t)[0] for v in (VEHICLE, stiff))
    assert few < many
    assert made.steps(batch([VEHICLE, stiff, VEHICLE]), 40.0, 40.0, t) == [few, many, few]


def test_steps_are_powers_of_two_and_grow_as_the_speed_falls() -> None:
    made, t = structure(VEHICLE), interval(RUN)
    found = [made.steps(batch([VEHICLE]), v, 40.0, t)[0] for v in (40.0, 10.0, 3.0, 1.0)]
    assert found == sorted(found) and found[-1] > found[0]
    assert all(n & (n - 1) == 0 for n in found)


def test_the_plain_bogie_at_40_m_s_and_a_tenth_of_a_metre_takes_one_step() -> None:
    assert structure(VEHICLE).steps(batch([VEHICLE]), 40.0, 40.0, 0.0025) == [1]


STIFF = {
    # k/F_y 2e4 1/m: the base matrices alone would take 2 steps, at which the run blows up
    "hysteresis": ["hysteresis at=secondary_lateral stiffness=1.6e7 yield=800"],
    "hysteresis in a primary": ["hysteresis at=primary_lateral stiffness=3e7 yield=1500"],
    "dry friction": ["dry_friction at=primary_yaw force=5000 slip_speed=1e-3"],
    "maxwell damper": ["maxwell_damper at=secondary_yaw stiffness=2e7 damping=1e4"],
    "blown off": ["maxwell_damper at=secondary_yaw stiffness=2e7 damping=1e5 blow_off=1500"],
    "flange": ["flange_contact at=contact clearance=0.002 stiffness=1e8"],
    "flange and saturation": [
        "flange_contact at=contact clearance=0.003 stiffness=1.46e7",
        "creep_saturation at=contact friction=0.2",
    ],
    "quadratic damper": ["quadratic_damper at=primary_yaw damping=2e7"],
    "cubic stiffness": ["cubic_stiffness at=primary_lateral stiffness=1e12"],
    "rail": ["rail_flexibility at=track stiffness=1e8 damping=1e4"],
    "rail and sliding wheels": [
        "rail_flexibility at=track stiffness=2e7 damping=3e4",
        "creep_saturation at=contact friction=0.1",
    ],
    "coach": ["coach_mode at=secondary_lateral mass=290 stiffness=2e6 damping=1e5"],
}


@pytest.mark.parametrize("name", STIFF)
def test_a_stiff_law_gets_steps_at_which_it_is_within_a_thousandth_of_twice_as_many(name: str) -> None:
    effects = [parse(word) for word in STIFF[name]]
    steps = enough(VEHICLE, RUN, effects)
    found, twice = (kernel(VEHICLE, RUN, effects, n) for n in (steps, 2 * steps))
    print(name, steps, {k: f"{x:.2g}" for k, x in apart(found, twice).items()})
    assert apart(found, twice)["e1"] < 1e-3
