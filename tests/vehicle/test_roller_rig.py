"""A wheelset on rollers of finite radius, against an independent model of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui.running_stability.critical_speed import critical_speeds
from railui.vehicle.design_reader import load_design
from railui.vehicle.model import Model
from tests.truth.roller_rig import Rig, critical_speed, rate

DESIGN = load_design(Path(__file__).parents[2] / "designs/roller_rig.yaml")
MODEL = Model(DESIGN)
RADIUS = "vehicle.elements.wheelset.roller_radius"


def linear_critical_speed(model: Model) -> float:
    (found,) = critical_speeds(model, model.row[None], 100.0)
    assert found is not None
    return found.speed


def test_the_critical_speed_agrees_with_the_independent_model() -> None:
    # the truth takes the contact point of a yawed wheel to second order in r delta/b, 3 %
    assert linear_critical_speed(MODEL) == pytest.approx(critical_speed(Rig()), rel=1e-3)


def test_smaller_rollers_lower_the_critical_speed() -> None:
    found = [linear_critical_speed(Model(DESIGN.with_values({RADIUS: R}))) for R in (0.4, 0.8, 2.0)]
    known = [critical_speed(replace(Rig(), R=R)) for R in (0.4, 0.8, 2.0)]
    assert found == sorted(found)
    assert found == pytest.approx(known, rel=1.5e-3)


def test_state_derivatives_agree_with_the_independent_model() -> None:
    """Every term of rollers: their shift and its rate, the yaw moment, the spin."""
    model = Model(DESIGN.with_values({"contact.wheels.contact_angle": 0.0}))
    rig, vehicles, batch = replace(Rig(), delta=0.0), model.vehicles(), model.single_batch()
    rng = np.random.default_rng(3)
    for _ in range(20):
        x, u, slope = rng.normal(0.0, [2e-3, 1e-3, 0.05, 0.03]), rng.normal(0.0, 2e-3), rng.normal(0.0, 2e-3)
        row = np.zeros(9)
        row[1], row[2], row[3] = 30.0, u, slope
        found = vehicles.state_derivatives(batch, row, x[None])[0]
        known = rate(rig, x, 30.0, u, 30.0 * slope)
        assert found[2:4] == pytest.approx(known[2:], rel=2e-3, abs=0.05)


def test_rollers_carry_the_wheelset_along_and_rails_do_not() -> None:
    """A steady lateral speed of the rollers creeps as much as the wheelset's own, that of rails not at all."""
    track = Model(DESIGN)
    row = np.zeros(9)
    row[1], row[3] = 40.0, 1e-4
    still = track.vehicles().state_derivatives(track.single_batch(), row, np.zeros((1, 4)))[0]
    moving = track.vehicles().state_derivatives(
        track.single_batch(), np.where(np.arange(9) == 3, 0.0, row), np.array([[0.0, 0.0, -40.0 * 1e-4, 0.0]])
    )[0]
    damping = 2 * 500.0 * 40.0 * 1e-4 / 1200.0  # of the box dampers, which feel the wheelset's speed alone
    assert still[2] == pytest.approx(moving[2] - damping, rel=1e-6)
