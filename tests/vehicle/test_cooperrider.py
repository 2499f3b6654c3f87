"""Cooperrider's bogie of a design file: published critical speed and equations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from railui.track.excitation import Excitation, resolve_track
from railui.vehicle.design_reader import load_design
from railui.vehicle.model import Model
from tests.truth import cooperrider as truth

MODEL = Model(load_design(Path(__file__).parents[2] / "designs/cooperrider.yaml"))
# frame lateral, yaw, roll (the other way round), then the wheelsets, as the kernel has them
ORDER, SIGN = [4, 5, 6, 0, 1, 2, 3], np.array([1, 1, -1, 1, 1, 1, 1])


def test_the_hopf_bifurcation_lies_where_it_was_published() -> None:
    critical = brentq(lambda V: MODEL.eigenvalues(V)[0].real.max(), 60.0, 75.0, xtol=1e-9)
    frequency = abs(MODEL.eigenvalues(critical)[0][0].imag) / (2 * np.pi)
    assert critical == pytest.approx(68.667, abs=1e-3)
    assert frequency == pytest.approx(3.998, abs=1e-3)
    assert abs(critical - 68.66) < 0.01  # bifurcation.de


@pytest.mark.parametrize("speed", [10.0, 40.0, 68.0, 90.0])
def test_eigenvalues_are_those_of_the_published_equations(speed: float) -> None:
    found = np.sort_complex(MODEL.eigenvalues(speed)[0])
    known = np.sort_complex(np.linalg.eigvals(truth.state_matrix(speed)))
    assert np.abs(found - known).max() < 1e-9 * np.abs(known).max()


def test_eigenvalues_of_the_state_matrix_equal_those_of_the_kernel() -> None:
    matrix = MODEL.vehicles().state_matrix(MODEL.single_batch(), 50.0)[0]
    assert np.sort_complex(np.linalg.eigvals(matrix)) == pytest.approx(np.sort_complex(MODEL.eigenvalues(50.0)[0]))


def test_state_derivatives_agree_with_the_published_equations() -> None:
    vehicles, batch = MODEL.vehicles(), MODEL.single_batch()
    rng = np.random.default_rng(1)
    for _ in range(20):
        q, v = rng.normal(0.0, 8e-3, 7), rng.normal(0.0, 0.1, 7)
        row = np.zeros(14)
        row[1], row[2], row[7] = 50.0, 1e-3, -2e-3
        found = vehicles.state_derivatives(batch, row, np.concatenate([(SIGN * q[ORDER]), SIGN * v[ORDER]])[None])[0]
        known = truth.rate(np.concatenate([q, v]), 50.0, (1e-3, -2e-3))[7:]
        assert found[7:] == pytest.approx(SIGN * known[ORDER], rel=1e-9, abs=1e-9)


def test_a_simulation_over_a_track_is_that_of_the_published_equations() -> None:
    road = Excitation(resolve_track("erri_b176_high length=300 seed=3 spacing=0.1"), 60.0)
    table = road.table(MODEL.wheelset_spacing(), 1)
    table[:, [4, 5, 9, 10]] = 0.0  # the published form has no cross-level
    channels = ["y.wheelset_1", "psi.wheelset_1", "y.wheelset_2", "psi.wheelset_2", "y.frame", "psi.frame", "phi.frame"]
    found, lost = MODEL.vehicles().simulate(MODEL.single_batch(), table, road.dt, 1, channels)
    known = truth.march(np.zeros(14), 60.0, road.dt, table[:, [2, 7]])[:, :7] * np.array([1, 1, 1, 1, 1, 1, -1])
    assert lost[0] == -1 and np.abs(found[0, 0]).max() > 5e-3
    assert np.abs(found[0].T - known).max(axis=0) == pytest.approx(0.0, abs=1e-4 * known.std(axis=0).min())


def test_every_number_of_the_vehicle_can_be_changed() -> None:
    softer = Model(MODEL.design.with_values({"vehicle.elements.primary.longitudinal_stiffness": "1 MN/m"}))
    assert softer.eigenvalues(60.0)[0][0] != pytest.approx(MODEL.eigenvalues(60.0)[0][0])
    wider = Model(MODEL.design.with_values({"vehicle.elements.wheelset.half_wheelbase": 1.2}))
    assert wider.wheelset_spacing() == pytest.approx((0.0, 2.4))
