"""The plain bogie of the kernel against the independent generator: parameters, speed, coach forces, initial state."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.kernel.pairs import (
    CHANNELS,
    ROUNDING,
    accelerating_run,
    assert_same,
    asymmetric_bogie,
    batch,
    interval,
    kernel,
    relative_differences,
    structure,
    table,
    tangent_run,
    with_coach_forces,
)
from tests.truth.bogie import Vehicle
from tests.truth.effects import parse
from tests.truth.files import paths
from tests.truth.march import simulate, simulate_many


def test_seventeen_uneven_bogies_side_by_side_are_the_generator_s() -> None:
    run, vehicles = tangent_run(10.0), [asymmetric_bogie(seed) for seed in range(17)]
    truths = simulate_many(vehicles, [run] * 17, steps=1)
    for vehicle, truth in zip(vehicles, truths, strict=True):
        assert_same(kernel(vehicle, run), truth, ROUNDING)


def test_every_number_of_a_bogie_moves_it_as_it_moves_the_generator_s() -> None:
    run, base = tangent_run(2.0), asymmetric_bogie()
    letters = ["m_b", "I_zb", "m_a", "I_za", "I_ya", "a", "b", "b_c", "r", "N", "c_y", "c_x", "c_sy", "c_spsi"]
    letters += ["k_y", "k_psi", "kappa_s", *(f"{x}{i}" for x in WHEEL_RAIL for i in (0, 1))]
    assert len(letters) == len(paths(base)) - 1  # the clearance stands in an effect
    moved = [nudged(base, letter) for letter in letters]
    plain, truths = kernel(base, run), simulate_many(moved, [run] * len(moved), steps=1)
    for letter, vehicle, truth in zip(letters, moved, truths, strict=True):
        found = kernel(vehicle, run)
        assert_same(found, truth, ROUNDING)
        assert max(relative_differences(found, plain).values()) > 1e-4, letter


WHEEL_RAIL = ("lam", "kappa_x", "kappa_y", "epsilon", "delta", "sigma")


def nudged(vehicle: Vehicle, letter: str) -> Vehicle:
    """A vehicle with one of its numbers a tenth larger."""
    name, i = (letter[:-1], int(letter[-1])) if letter[-1] in "01" else (letter, None)
    value = getattr(vehicle, name)
    new = 1.1 * value if i is None else tuple(x * (1.1 if i == j else 1.0) for j, x in enumerate(value))
    changed: dict[str, Any] = {name: new}
    return replace(vehicle, **changed)


@pytest.mark.parametrize("steps", [2, 4])
def test_steps_between_the_samples_read_the_same_track(steps: int) -> None:
    run, vehicle = tangent_run(2.0), asymmetric_bogie(1)
    assert_same(kernel(vehicle, run, steps=steps), simulate(vehicle, run, steps=steps), ROUNDING)


# between samples the table has v and s on a cubic spline in t, the generator on a line: 2e-6 m of s at 0.5 m/s^2
BETWEEN_SAMPLES = 5e-5


def test_coefficients_follow_a_speed_that_wanders() -> None:
    run, vehicle = accelerating_run(), asymmetric_bogie(2)
    assert np.ptp(run.v) > 1.5
    assert_same(kernel(vehicle, run, steps=2), simulate(vehicle, run, steps=2), BETWEEN_SAMPLES)


@pytest.mark.parametrize(("qy", "qpsi"), [(3e3, 0.0), (0.0, 2e3), (3e3, 2e3)], ids=["Qy", "Qpsi", "both"])
def test_measured_coach_forces_drive_the_frame(qy: float, qpsi: float) -> None:
    run, vehicle = with_coach_forces(tangent_run(3.0), qy, qpsi), asymmetric_bogie(3)
    found = kernel(vehicle, run)
    assert_same(found, simulate(vehicle, run, steps=1), ROUNDING)
    assert max(relative_differences(found, kernel(vehicle, tangent_run(3.0))).values()) > 0.05


def test_a_measured_coach_force_replaces_other_forces_at_its_location() -> None:
    run, vehicle = with_coach_forces(tangent_run(2.0), 3e3), asymmetric_bogie(4)
    there = [
        parse("dry_friction at=secondary_lateral force=2000 slip_speed=0.02"),
        parse("coach_mode at=secondary_lateral mass=15e3 stiffness=3e5 damping=2e4"),
    ]
    further = [parse("dry_friction at=secondary_yaw force=1000 slip_speed=0.02")]
    bare = replace(vehicle, c_sy=0.0, k_y=0.0)
    assert np.array_equal(kernel(vehicle, run, there)["e1"], kernel(bare, run)["e1"])
    found = kernel(vehicle, run, [*there, *further])
    assert_same(found, simulate(vehicle, run, [*there, *further], steps=1), ROUNDING)
    assert relative_differences(found, kernel(vehicle, run))["e1"] > 1e-2


def test_a_wandering_speed_and_measured_forces_go_together() -> None:
    run, vehicle = with_coach_forces(accelerating_run(6.0), 3e3, 2e3), asymmetric_bogie(5)
    assert_same(kernel(vehicle, run, steps=2), simulate(vehicle, run, steps=2), BETWEEN_SAMPLES)


def test_a_run_starts_from_the_state_that_it_is_given() -> None:
    run, vehicle = tangent_run(2.0), asymmetric_bogie(6)
    state = np.random.default_rng(1).normal(0.0, 1.0, 12) * np.array([3e-3, 1e-3] * 3 + [0.05, 0.02] * 3)
    found = kernel(vehicle, run, state=state)
    assert found["e1"][0] == pytest.approx(state[2] - run.yw[0] - vehicle.r * run.phiw[0])
    assert found["rf"][0] == pytest.approx(state[7])
    assert_same(found, simulate(vehicle, run, steps=1, state=state), ROUNDING)


def test_states_of_effects_follow_those_of_the_bodies() -> None:
    run, vehicle = tangent_run(1.0), asymmetric_bogie(7)
    effects = [
        parse("coach_mode at=secondary_lateral mass=15e3 stiffness=3e5 damping=2e4"),
        parse("hysteresis at=primary_lateral stiffness=6e6 yield=1500"),
        parse("maxwell_damper at=secondary_yaw stiffness=2e6 damping=4e4"),
    ]
    motion = np.random.default_rng(2).normal(0.0, 1.0, 12) * np.array([3e-3, 1e-3] * 3 + [0.05, 0.02] * 3)
    coach, carried = np.array([2e-3, -0.03]), np.array([0.5, -0.8, 700.0])
    assert structure(vehicle, effects).state_count(batch([vehicle], [effects])) == 17
    state = np.concatenate([motion[:6], coach[:1], motion[6:], coach[1:], carried])
    truth = simulate(vehicle, run, effects, 12, np.concatenate([motion, coach, carried]))
    assert_same(kernel(vehicle, run, effects, 12, state=state), truth, ROUNDING)


def test_a_lane_with_a_speed_scale_is_a_run_at_the_scaled_speed() -> None:
    run, vehicle, share = tangent_run(3.0), asymmetric_bogie(8), 1.1
    faster = replace(run, t=run.t / share, v=run.v * share)
    pair = batch([vehicle, vehicle], speed_scale=np.array([1.0, share]))
    found, _ = structure(vehicle).simulate(pair, table(run, vehicle.a, 2), interval(run), 2, CHANNELS)
    for row, own in zip(found, (run, faster), strict=True):
        assert_same(dict(zip(CHANNELS, row, strict=True)), kernel(vehicle, own, steps=2), ROUNDING)
