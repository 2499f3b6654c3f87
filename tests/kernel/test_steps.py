"""Steps per sample: independent of neighbours, enough for stiff laws, an error if too many."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from railui.core import Batch, Vehicles
from tests.kernel.pairs import (
    asymmetric_bogie,
    batch,
    interval,
    kernel,
    relative_differences,
    required_steps,
    structure,
    tangent_run,
)
from tests.truth.bogie import Vehicle
from tests.truth.effects import Effect, parse

VEHICLE = asymmetric_bogie(40)
RUN = tangent_run(1.2)


def test_neighbours_do_not_raise_the_steps_of_a_vehicle() -> None:
    stiff = replace(VEHICLE, c_x=200e6)
    made, t = structure(VEHICLE), interval(RUN)
    few, many = (made.required_steps(batch([v]), 40.0, 40.0, t)[0] for v in (VEHICLE, stiff))
    assert few < many
    assert made.required_steps(batch([VEHICLE, stiff, VEHICLE]), 40.0, 40.0, t) == [few, many, few]


def test_steps_are_few_numbers_and_grow_as_the_speed_falls() -> None:
    made, t = structure(VEHICLE), interval(RUN)
    found = [made.required_steps(batch([VEHICLE]), v, 40.0, t)[0] for v in (40.0, 10.0, 3.0, 1.0)]
    assert found == sorted(found) and found[-1] > found[0]
    assert set(found) <= {2**k for k in range(8)} | {3 * 2**k for k in range(7)}


def test_the_plain_bogie_at_40_m_s_and_a_tenth_of_a_metre_takes_one_step() -> None:
    assert structure(VEHICLE).required_steps(batch([VEHICLE]), 40.0, 40.0, 0.0025) == [1]


@pytest.mark.parametrize(
    ("angle", "damping_ratio", "steps", "coarse"),
    [(0.9, 0.9, 1, 1), (1.2, 0.1, 2, 2), (1.2, 0.69, 2, 2), (1.2, 0.71, 2, 1), (1.6, 0.71, 2, 2), (2.9, 0.71, 3, 2)],
)
def test_only_damped_modes_take_longer_steps(angle: float, damping_ratio: float, steps: int, coarse: int) -> None:
    """Of an oscillator with the natural angular frequency w both eigenvalues have the magnitude w; angle = w dt."""
    dt = 0.005
    w = angle / dt
    numbers = np.array([[1.0, w**2, 2.0 * damping_ratio * w, 1.0, 0.0]])  # mass, stiffness, damping, gain, preload
    vehicles, one = Vehicles("rig"), Batch.from_arrays(numbers, np.zeros((1, 0)), np.zeros((1, 0)))
    assert vehicles.required_steps(one, 1.0, 1.0, dt) == [steps]
    assert vehicles.required_steps(one, 1.0, 1.0, dt, damped_mode_step=1.5) == [coarse]


STIFF = {
    # k/F_y 2e4 1/m: the base matrices alone would take 2 steps, at which the run blows up
    "hysteresis": ["hysteresis at=secondary_lateral stiffness=1.6e7 yield=800"],
    "hysteresis in a primary": ["hysteresis at=primary_lateral stiffness=3e7 yield=1500"],
    "hysteresis of an angle": ["hysteresis at=primary_yaw stiffness=3.2e7 yield=3120"],
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
    "soft rail and sliding wheels": [
        "rail_flexibility at=track stiffness=2e7 damping=1e3",
        "creep_saturation at=contact friction=0.05",
    ],
    "coach": ["coach_mode at=secondary_lateral mass=290 stiffness=2e6 damping=1e5"],
}


@pytest.mark.parametrize("name", STIFF)
def test_a_stiff_law_gets_enough_steps_for_an_error_of_0_1_percent(name: str) -> None:
    effects = [parse(word) for word in STIFF[name]]
    steps = required_steps(VEHICLE, RUN, effects)
    found, twice = (kernel(VEHICLE, RUN, effects, n) for n in (steps, 2 * steps))
    assert relative_differences(found, twice)["e1"] < 1e-3


def test_a_friction_spring_on_a_slow_sampled_track_stays_finite() -> None:
    # a sample every 0.2 m at 40 m/s; k/F_y 2e4 1/m
    effects = [parse("hysteresis at=primary_lateral stiffness=6e6 yield=300")]
    assert required_steps(VEHICLE, RUN, effects) > required_steps(VEHICLE, RUN)
    found, twice = (kernel(VEHICLE, RUN, effects, n * required_steps(VEHICLE, RUN, effects)) for n in (1, 2))
    assert all(np.isfinite(x).all() for x in found.values())
    assert max(relative_differences(found, twice).values()) < 1e-3


def test_a_friction_spring_that_yields_within_a_step_is_bounded_by_its_force() -> None:
    # k/F_y 2e5 1/m: its state would need a hundred steps to be stable at 0.3 m/s
    effects = [parse("hysteresis at=primary_lateral stiffness=6e7 yield=300")]
    fine, plain = kernel(VEHICLE, RUN, effects, 200), kernel(VEHICLE, RUN)
    change = relative_differences(fine, plain)
    for steps, share in ((2, 0.1), (4, 0.05), (8, 0.01)):
        error = relative_differences(kernel(VEHICLE, RUN, effects, steps), fine)
        assert all(error[c] < share * change[c] for c in change), steps


def test_wheels_that_slide_do_not_damp_the_rail() -> None:
    # creep alone would hold u' back to 46 1/s, sliding leaves k_r/c_r = 2e4 1/s
    rail = parse("rail_flexibility at=track stiffness=2e7 damping=1e3")
    slip = parse("creep_saturation at=contact friction=0.05")
    assert required_steps(VEHICLE, RUN, [rail]) < 8 < required_steps(VEHICLE, RUN, [rail, slip])


SLOW = np.geomspace(1.5, 12.0, 150)  # m/s, where creep damps so much that it decides on the steps


def steps_at_low_speeds(*effects: Effect, vehicle: Vehicle = VEHICLE) -> list[int]:
    made, one = structure(vehicle, effects), batch([vehicle], [list(effects)])
    return [made.required_steps(one, v, v, interval(RUN))[0] for v in SLOW]


def test_creep_steeper_than_linear_takes_more_steps() -> None:
    steep, linear = (
        parse(f"vermeulen_johnson at=contact friction=0.4 longitudinal_factor={k} lateral_factor={k}") for k in (3, 1)
    )
    assert steps_at_low_speeds(linear) == steps_at_low_speeds()
    assert np.greater(steps_at_low_speeds(steep), steps_at_low_speeds()).any()


def test_sliding_treads_leave_the_damping_of_a_flange_with_friction() -> None:
    rubbing = parse("flange_contact at=contact clearance=0.002 stiffness=14.6e6 friction=0.3 depth=0.012 angle=1.2")
    slip = parse("creep_saturation at=contact friction=0.15")
    hard_to_turn = replace(VEHICLE, I_za=3000.0)
    both, flange, tread = (
        steps_at_low_speeds(*some, vehicle=hard_to_turn) for some in ((rubbing, slip), (rubbing,), (slip,))
    )
    assert both == flange and np.greater(both, tread).any()


def test_a_vehicle_too_stiff_for_its_samples_is_an_error_with_a_remedy() -> None:
    with pytest.raises(ValueError, match=r"needs \d+ steps per sample of 0\.005 s, 64 are allowed; .*soften"):
        required_steps(VEHICLE, RUN, [parse("spring at=primary_yaw stiffness=1e12")])
    with pytest.raises(ValueError, match=r"needs \d+ steps per sample of 0\.005 s, 64 are allowed; raise the mass"):
        required_steps(replace(VEHICLE, m_a=1.0), RUN)
