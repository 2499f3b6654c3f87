"""Margins of a parameter to limits of itself and of a critical speed."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from railui.fleet.fleet_file import Limit
from railui.fleet.limits import Margin, margin_of_criterion, margin_of_value
from railui.running_stability.critical_speed import critical_speeds
from railui.vehicle.design_reader import load_design
from railui.vehicle.resolve import resolve_model

COACH = load_design(Path(__file__).parents[2] / "designs/manchester_coach.yaml")
CONICITY, STIFFNESS = "contact.wheels.conicity", "vehicle.elements.primary.lateral_stiffness"


def critical_speed(path: str, value: float) -> float:
    model = resolve_model(COACH.with_values({path: value}))
    found = critical_speeds(model, model.row[None], 120.0)[0]
    assert found is not None
    return found.speed


@pytest.mark.parametrize(
    ("limit", "margin"),
    [
        (Limit("x", 2.5, True), Margin(2.5, math.inf, False)),
        (Limit("x", 3.3, True), Margin(3.3, math.inf, True)),
        (Limit("x", 3.3, False), Margin(-math.inf, 3.3, False)),
        (Limit("x", 2.5, False), Margin(-math.inf, 2.5, True)),
    ],
)
def test_the_margin_of_a_limit_of_the_parameter(limit: Limit, margin: Margin) -> None:
    assert margin_of_value(limit, 3.2) == margin


def test_the_conicity_at_which_a_critical_speed_is_reached() -> None:
    found = margin_of_criterion(COACH, Limit(CONICITY, 60.0, True, "linear_critical_speed"), 0.2)
    assert not found.is_exceeded and found.low == -math.inf
    assert critical_speed(CONICITY, found.high) == pytest.approx(60.0, rel=0.01)


def test_a_vehicle_below_its_critical_speed_has_exceeded_the_limit() -> None:
    assert critical_speed(CONICITY, 0.2) < 75.0
    found = margin_of_criterion(COACH, Limit(CONICITY, 75.0, True, "linear_critical_speed"), 0.2)
    assert found.is_exceeded


def test_a_critical_speed_that_falls_on_both_sides_has_a_value_on_each() -> None:
    """The critical speed over the primary stiffness has a maximum: a soft and a stiff spring reach 72 m/s."""
    stiffness = COACH.value(STIFFNESS)
    found = margin_of_criterion(COACH, Limit(STIFFNESS, 72.0, True, "linear_critical_speed"), stiffness)
    assert not found.is_exceeded and 0.15 * stiffness < found.low < stiffness < found.high
    for value in (found.low, found.high):
        assert critical_speed(STIFFNESS, value) == pytest.approx(72.0, rel=0.02)
    assert (found.value_towards(-1.0), found.value_towards(1.0)) == (found.low, found.high)
