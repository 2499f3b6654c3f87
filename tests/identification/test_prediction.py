"""Prediction of measured channels by a model on a segment."""

from __future__ import annotations

import numpy as np

from railui.campaign.comparison import kernel_filter, nrmse
from railui.identification.prediction import Predictor, required_steps, required_steps_each
from tests.blind.simulated import SimulatedCampaign, simulated_campaign


def predictor_of(case: SimulatedCampaign, **options) -> Predictor:
    return Predictor(case.nominal, case.dataset.estimation[0], **options)


def test_steps_are_those_that_the_model_needs_unless_given():
    case = simulated_campaign()
    predictor = predictor_of(case)
    assert predictor.steps == required_steps(case.nominal, predictor.segment) > 0
    assert predictor_of(case, given_steps=7).steps == 7


def test_each_vehicle_of_a_batch_needs_the_steps_of_its_model():
    case = simulated_campaign()
    segment = case.dataset.estimation[0]
    vehicles = case.nominal.vehicles(segment.coach_forces)
    batch = case.nominal.batch(np.tile(case.nominal.row, (3, 1)))
    steps = required_steps_each(vehicles, batch, segment)
    assert steps.tolist() == 3 * [required_steps(case.nominal, segment)]


def test_an_initial_state_moves_the_vehicle_from_the_first_sample():
    case = simulated_campaign()
    segment = case.dataset.estimation[0]
    states = case.nominal.vehicles(segment.coach_forces).state_count(case.nominal.single_batch())
    at_rest = predictor_of(case).simulate(["d1"]).series[0, 0, 0]
    moved = predictor_of(case, initial_state=np.full(states, 1e-3)).simulate(["d1"]).series[0, 0, 0]
    assert abs(moved - at_rest) > 1e-5


def test_a_filtered_simulation_equals_the_compared_channels():
    case = simulated_campaign()
    campaign, segment = case.dataset.campaign, case.dataset.estimation[0]
    weights = np.ones(len(segment.channels))
    filtered = predictor_of(case, filter=kernel_filter(campaign, segment, weights)).simulate().series[0]
    comparison = predictor_of(case).predict(campaign).comparison
    rows = [segment.channels.index(c) for c in comparison.channels]
    scale = comparison.simulated.std(axis=1, keepdims=True)
    np.testing.assert_allclose(filtered[rows] / scale, comparison.simulated / scale, atol=1e-9)


def test_a_vehicle_that_diverges_is_predicted_as_nan_with_its_time():
    case = simulated_campaign()
    conicities = [f"contact.{wheelset}.conicity" for wheelset in ("leading", "trailing")]
    unstable = case.nominal.with_path_values(conicities, np.array([5.0, 5.0]))
    prediction = Predictor(unstable, case.dataset.estimation[0]).predict(case.dataset.campaign)
    assert prediction.diverged_at is not None and prediction.diverged_at > 0.0
    assert np.all(np.isnan(prediction.series))
    assert all(np.isnan(error) for error in nrmse([prediction.comparison]).values())
