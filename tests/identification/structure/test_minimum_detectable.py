"""Minimum detectable effects: both criteria worked out by hand, and the parameter at which they are met."""

from __future__ import annotations

from math import sqrt
from pathlib import Path

import numpy as np
import pytest

from railui.identification.structure.candidates import Candidate
from railui.identification.structure.gain_forecast import PredictedGain, _summary
from railui.identification.structure.minimum_detectable import (
    POWER_QUANTILE,
    amount_of_gain,
    minimum_detectable_amount,
    minimum_detectable_effects,
    value_of_unit_amount,
    without_unphysical_sizes,
)
from railui.identification.structure.score_result import ScoreResult
from railui.identification.structure.score_test import ScoreTestResult
from railui.vehicle.design_reader import load_design

ROOT = Path(__file__).parents[3]
SPRING = Candidate("spring", "primary_lateral", None, ({"stiffness": 2e5}, {"stiffness": 8e5}))
GAIN = Candidate("sensor_gain", "e1", None, ({"gain": 1.1},))
PLAY = Candidate("free_play", "primary_lateral", 1, ({"half_width": 1e-4}, {"half_width": 1e-2}))
BLOCKS = 10_000
MIN_GAIN = 0.1
SQUARED_GAIN = 1.0 / 0.9**2 - 1.0  # of the squared error, where the error falls by a tenth


def score(candidate: Candidate, shape: int = 0, norm: float = 1e6) -> ScoreResult:
    """Return a score with block contributions of 1 and -1 in turn, whose standard deviation is 100."""
    return ScoreResult(candidate, shape, rho=0.0, amount=0.0, scores=np.tile([1.0, -1.0], BLOCKS // 2), norm=norm)


def score_test(*scores: ScoreResult, rss: float) -> ScoreTestResult:
    return ScoreTestResult(scores, scores, 0.5, 3.0, rss)


def test_an_effect_exceeds_the_critical_score_with_90_percent_power() -> None:
    test = score_test(score(SPRING), rss=1e-2)
    expected = (3.0 + POWER_QUANTILE) * 100.0 / 1e6
    assert minimum_detectable_amount(score(SPRING), test, MIN_GAIN, 1.0, {}) == pytest.approx(expected, rel=1e-3)


def test_an_effect_lowers_the_error_by_the_minimum_relative_gain() -> None:
    test = score_test(score(SPRING), rss=4.0)
    expected = 1.4 * sqrt(SQUARED_GAIN * 4.0 / 1e6)
    assert minimum_detectable_amount(score(SPRING), test, MIN_GAIN, 1.0, {}) == pytest.approx(expected, rel=1e-9)


def test_an_effect_lowers_the_validation_error_as_predicted() -> None:
    test = score_test(score(SPRING), rss=1e-2)
    found = minimum_detectable_amount(score(SPRING), test, MIN_GAIN, 0.05, {(SPRING, 0): PredictedGain(9.0)})
    assert found == pytest.approx(test.settings.absorption_margin * sqrt(SQUARED_GAIN * 0.05**2 / 9.0), rel=1e-9)


def test_nine_of_ten_scattered_gains_exceed_the_required_one() -> None:
    predicted, required = PredictedGain(9.0, noise_sd=2e-3, scatter=0.3), 1e-4
    amount = amount_of_gain(predicted, required)
    rng = np.random.default_rng(2)
    mean = predicted.mean * np.exp(predicted.scatter * rng.standard_normal(20_000))
    only_scatter = amount_of_gain(PredictedGain(9.0, scatter=0.3), required)
    only_noise = amount_of_gain(PredictedGain(9.0, noise_sd=2e-3), required)
    noise = 2.0 * predicted.noise_sd * rng.standard_normal(20_000)
    assert np.mean(only_scatter**2 * mean >= required) == pytest.approx(0.9, abs=0.01)
    assert np.mean(only_noise**2 * 9.0 + only_noise * noise >= required) == pytest.approx(0.9, abs=0.01)
    assert 0.9 <= np.mean(amount**2 * mean + amount * noise >= required) <= 0.98


def test_a_force_has_the_smallest_strength_of_its_shapes() -> None:
    (row,) = minimum_detectable_effects(score_test(score(SPRING), score(SPRING, 1, 1e8), rss=4.0), MIN_GAIN, 1.0, {})
    # the second shape is four times as stiff and its norm ten times as large
    assert (row["parameter"], row["unit"]) == ("stiffness", "N/m")
    assert row["with"] == {}
    assert row["value"] == pytest.approx(8e5 * 1.4 * sqrt(SQUARED_GAIN * 4.0 / 1e8), rel=1e-9)


def test_a_sensor_has_the_deviation_from_its_neutral_value() -> None:
    (row,) = minimum_detectable_effects(score_test(score(GAIN), rss=4e6), MIN_GAIN, 1.0, {})
    assert row["value"] == pytest.approx(1.0 + 1.4 * sqrt(SQUARED_GAIN * 4.0) * 0.1, rel=1e-9)


def test_a_law_without_strength_has_the_parameter_of_unit_amount() -> None:
    assert value_of_unit_amount([*PLAY.shapes], [4.0, 0.25], "half_width") == pytest.approx(1e-3)
    shapes = [{"half_width": 1e-4}, {"half_width": 1e-3}]
    assert value_of_unit_amount(shapes, [12.5, 1.25], "half_width") == pytest.approx(1.25e-3)
    assert value_of_unit_amount(
        [{"half_width": 1e-3}, {"half_width": 1e-2}], [0.25, 0.0625], "half_width"
    ) == pytest.approx(1e-4)


def test_beyond_the_simulated_shapes_the_two_nearest_are_extrapolated() -> None:
    shapes = [{"half_width": h} for h in (1e-3, 1e-2, 1e-1)]
    assert value_of_unit_amount(shapes, [0.25, 0.0625, 0.05], "half_width") == pytest.approx(1e-4)
    assert value_of_unit_amount(shapes, [20.0, 15.0, 1.5], "half_width") == pytest.approx(0.15)


def test_the_weakest_detectable_shape_counts_where_the_strongest_is_absorbed() -> None:
    shapes = [{"half_width": h} for h in (1e-4, 1e-3, 1e-2)]
    sizes = [1.0, 10.0, 100.0]
    assert value_of_unit_amount(shapes, [0.5, 0.05, 0.8], "half_width", sizes) == pytest.approx(5e-5)
    assert value_of_unit_amount(shapes, [5.0, 0.5, 2.0], "half_width", sizes) == pytest.approx(5e-4)


def test_a_friction_is_detectable_below_a_value() -> None:
    shapes = [{"friction": f} for f in (0.01, 0.1)]
    assert value_of_unit_amount(shapes, [0.1, 10.0], "friction", [5.0, 1.0]) == pytest.approx(0.1 / 10**0.5)


def test_an_effect_that_no_shape_makes_detectable_has_no_value() -> None:
    shapes = [{"half_width": h} for h in (1e-4, 1e-3, 1e-2)]
    assert value_of_unit_amount(shapes, [9.0, 3.0, 5.0], "half_width", [1.0, 10.0, 100.0]) is None
    assert value_of_unit_amount(shapes[:2], [30.0, 3.0], "half_width", [1.0, 10.0]) is None  # beyond twice 1 mm


def test_an_amount_that_no_parameter_changes_is_unknown() -> None:
    assert value_of_unit_amount([*PLAY.shapes], [4.0, 4.0], "half_width") is None
    assert value_of_unit_amount([{"half_width": 1e-4}], [4.0], "half_width") is None


def test_a_size_beyond_the_catalogue_is_not_detectable() -> None:
    design = load_design(ROOT / "designs" / "test_bogie.yaml")
    springs = [
        {"kind": "spring", "at": "primary_lateral", "parameter": "stiffness", "value": value, "with": {"x": 1.0}}
        for value in (5e8, 7e8, None)  # the catalogue ends at a hundred times the two springs of 3 MN/m
    ]
    kept, beyond, unknown = without_unphysical_sizes(springs, design)
    assert kept == springs[0] and unknown["value"] is None
    assert beyond["value"] is None and beyond["with"] == {}


def test_the_scatter_of_a_gain_predicted_from_a_single_block_is_unknown():
    one, two = np.array([[1.0, 0.1]]), np.array([[1.0, 0.1], [1.5, -0.1]])
    assert np.isnan(_summary(one, 0.3).mean)  # no prediction
    assert _summary(one, 1.0).scatter == 0.0  # all of the runs
    assert _summary(two, 0.3).scatter == pytest.approx(np.sqrt(0.7 * 2 * 0.125) / 2.5)
