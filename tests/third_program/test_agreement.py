"""Motions of the same vehicles by Exudyn and by railui."""

from __future__ import annotations

import pytest

pytest.importorskip("exudyn")

from tests.third_program.agreement import bogie_differences, coach_differences, rig_differences


def assert_within(differences: dict[str, float], accelerations: float, motions: float) -> None:
    for name, x in differences.items():
        assert x < (accelerations if name.startswith(("ay", "az", "d")) else motions), (name, x)


def test_the_bogie_moves_as_in_exudyn() -> None:
    assert_within(bogie_differences(), 1e-3, 2e-4)


def test_halved_steps_leave_a_quarter_of_the_difference() -> None:
    # the trapezoidal rule is of second order: what is left is its error, not another vehicle
    coarse, fine = bogie_differences(per_sample=1), bogie_differences(per_sample=2)
    for name in coarse:
        assert 3.0 < coarse[name] / fine[name] < 5.0


def test_the_mass_on_a_bench_moves_as_in_exudyn() -> None:
    assert_within(rig_differences(), 2e-4, 2e-4)


@pytest.mark.slow  # some 20 s
def test_the_coach_moves_as_in_exudyn() -> None:
    assert_within(coach_differences(), 1e-3, 1e-4)


@pytest.mark.slow  # some 20 s
def test_roll_inertia_of_wheelsets_is_a_small_part_of_the_motion() -> None:
    differences = coach_differences(roll_inertia=None)
    assert differences["e1"] > 2e-3 and max(differences.values()) < 0.05
