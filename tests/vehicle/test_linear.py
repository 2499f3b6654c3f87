"""Vehicles whose eigenvalues are undefined: a state matrix that is not finite, or an iteration that fails."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from railui.core import matrix_eigenvalues
from railui.identification.estimation.free_parameters import free_parameters
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.multiple_shooting import unstable_segments
from railui.identification.estimation.problem import prepare_segments
from railui.running_stability.critical_speed import linear_stability_many
from railui.running_stability.summary import stability
from railui.vehicle.linear import eigenvalues
from railui.vehicle.model import Model
from railui.vehicle.resolve import resolve_model
from tests.blind.simulated import simulated_campaign

BOGIE = Path(__file__).parents[2] / "designs" / "check_bogie.yaml"
MASS = "vehicle.frame.mass"
NEXT_TO_NOTHING = 1e-308  # kg, on which any force is an infinite acceleration


def weightless(model: Model) -> np.ndarray:
    """Rows of the vehicle itself and of one whose frame has next to no mass."""
    rows = np.tile(model.row, (2, 1))
    rows[1, model.columns[MASS]] = NEXT_TO_NOTHING
    return rows


def of_weightless_frame(model: Model) -> Model:
    """Return the vehicle with a frame of next to no mass, past the check of a design's numbers."""
    values = {**model.design.values, MASS: NEXT_TO_NOTHING}
    return Model(dataclasses.replace(model.design, values=values), model.sensors, model.phases)


@pytest.mark.parametrize("scaled", [False, True])
def test_a_vehicle_without_eigenvalues_does_not_affect_its_batch(scaled: bool):
    model = resolve_model(BOGIE)
    rows = weightless(model)
    found = eigenvalues(model, rows, np.array([40.0, 40.0])) if scaled else model.eigenvalues(40.0, rows)
    np.testing.assert_array_equal(found[0], model.eigenvalues(40.0)[0])
    assert np.isnan(found[1]).all()
    assert model.growth_rate(40.0) < 0 and model.growth_rate(40.0, rows) == np.inf


class Unended:
    """A kernel whose iteration for eigenvalues ends on no vehicle."""

    def __init__(self, core: object) -> None:
        self.core = core

    def eigenvalues(self, batch: object, speed: float) -> list[list[tuple[float, float]]]:
        return [[] for _ in range(len(batch))]  # type: ignore[arg-type]

    def __getattr__(self, name: str) -> object:
        return getattr(self.core, name)


def test_where_the_iteration_of_the_kernel_does_not_end_lapack_answers():
    model = resolve_model(BOGIE)
    vehicles = model.vehicles()
    batch = dataclasses.replace(model.single_batch(), speed_scale=np.array([2.0]))
    expected = vehicles.eigenvalues(batch, 20.0)
    vehicles._core, core = Unended(vehicles._core), vehicles._core  # type: ignore[assignment]
    try:
        found = vehicles.eigenvalues(batch, 20.0)
    finally:
        vehicles._core = core
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_eigenvalues_of_a_matrix_are_sorted_by_their_real_part():
    found = matrix_eigenvalues(np.array([np.diag([-1.0, 3.0, 2.0])]))
    assert found[0].real.tolist() == [3.0, 2.0, -1.0]


def test_a_trial_model_without_eigenvalues_is_not_allowed_in_a_fit():
    campaign = simulated_campaign("free_play at=primary_lateral half_width=4e-4")
    context, model, segments = campaign.context, campaign.nominal, campaign.dataset.estimation
    free = free_parameters(context, model, [MASS])
    prepared = prepare_segments(context, model, segments)
    optimiser = GaussNewton(context, model, free, prepared, stable=True)
    x = np.array([[model.value(MASS)], [NEXT_TO_NOTHING]])
    costs = optimiser.misfit(x)
    assert np.isfinite(costs[0]) and costs[1] == np.inf and optimiser.constrained
    light = of_weightless_frame(model)
    assert unstable_segments(light, segments, 0.0) == {s.segment_key.name for s in segments}


def test_a_search_counts_a_vehicle_without_eigenvalues_as_unstable():
    model = resolve_model(BOGIE)
    found = linear_stability_many(model, weightless(model), [20.0])
    whole = linear_stability_many(model, model.row[None], [20.0])
    assert found["linear_damping"][0] == whole["linear_damping"][0] and np.isnan(found["linear_damping"][1])
    assert found["linear_critical_speed"].tolist() == [whole["linear_critical_speed"][0], 0.0]


def test_stability_of_a_vehicle_without_eigenvalues_is_rejected():
    model = resolve_model(BOGIE)
    with pytest.raises(ValueError, match=r"state matrix of this vehicle is not finite.*masses"):
        stability(of_weightless_frame(model), [10.0, 20.0])
