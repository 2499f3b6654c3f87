"""The smallest effect that a campaign would have shown: both gates by hand, the parameter at which they are passed."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from railui.identification.structure.candidates import Candidate
from railui.identification.structure.evidence import ScoreResult
from railui.identification.structure.score_test import POWER, ScoreTestResult
from railui.report.loop.detectable import _crossing, minimum_detectable_amount, minimum_detectable_effects

SPRING = Candidate("spring", "primary_lateral", None, ({"stiffness": 2e5}, {"stiffness": 8e5}))
GAIN = Candidate("sensor_gain", "e1", None, ({"gain": 1.1},))
PLAY = Candidate("free_play", "primary_lateral", 1, ({"half_width": 1e-4}, {"half_width": 1e-2}))
BLOCKS = 10_000
MATERIAL = 0.1
FREED = 1.0 / 0.9**2 - 1.0  # of the squared error, where the error falls by a tenth


def seen(candidate: Candidate, shape: int = 0, norm: float = 1e6) -> ScoreResult:
    """A shape about which the blocks say 1 and -1 in turn: the spread of its score is 100."""
    return ScoreResult(candidate, shape, 0.0, 0.0, np.tile([1.0, -1.0], BLOCKS // 2), norm)


def traced(*sightings: ScoreResult, rss: float) -> ScoreTestResult:
    return ScoreTestResult(sightings, sightings, 0.5, 3.0, rss)


def test_an_effect_must_pass_the_critical_score_with_ninety_per_cent_power() -> None:
    trace = traced(seen(SPRING), rss=1e-2)
    expected = (3.0 + POWER) * 100.0 / 1e6
    assert minimum_detectable_amount(seen(SPRING), trace, MATERIAL, 1.0, {}) == pytest.approx(expected, rel=1e-3)


def test_and_lower_the_misfit_by_what_is_material() -> None:
    trace = traced(seen(SPRING), rss=4.0)
    expected = 1.4 * sqrt(FREED * 4.0 / 1e6)
    assert minimum_detectable_amount(seen(SPRING), trace, MATERIAL, 1.0, {}) == pytest.approx(expected, rel=1e-9)


def test_and_the_error_of_the_validating_runs_as_it_is_foreseen() -> None:
    trace = traced(seen(SPRING), rss=1e-2)
    found = minimum_detectable_amount(seen(SPRING), trace, MATERIAL, 0.05, {(SPRING, 0): 9.0})
    assert found == pytest.approx(1.4 * sqrt(FREED * 0.05**2 / 9.0), rel=1e-9)


def test_of_a_force_the_least_strength_of_any_shape_is_told() -> None:
    (row,) = minimum_detectable_effects(traced(seen(SPRING), seen(SPRING, 1, 1e8), rss=4.0), MATERIAL, 1.0, {})
    # the second shape is four times as stiff and seen ten times as well
    assert (row["parameter"], row["unit"]) == ("stiffness", "N/m")
    assert row["value"] == pytest.approx(8e5 * 1.4 * sqrt(FREED * 4.0 / 1e8), rel=1e-9)


def test_of_a_sensor_the_departure_from_what_it_should_be_is_told() -> None:
    (row,) = minimum_detectable_effects(traced(seen(GAIN), rss=4e6), MATERIAL, 1.0, {})
    assert row["value"] == pytest.approx(1.0 + 1.4 * sqrt(FREED * 4.0) * 0.1, rel=1e-9)


def test_of_a_law_without_a_strength_the_parameter_at_which_all_of_it_is_just_enough() -> None:
    assert _crossing([*PLAY.shapes], [4.0, 0.25], "half_width") == pytest.approx(1e-3)
    assert _crossing([{"half_width": 1e-4}, {"half_width": 1e-3}], [16.0, 4.0], "half_width") == pytest.approx(1e-2)
    assert _crossing([{"half_width": 1e-3}, {"half_width": 1e-2}], [0.25, 0.0625], "half_width") == pytest.approx(1e-4)


def test_beyond_the_shapes_that_were_run_the_two_nearest_go_on() -> None:
    shapes = [{"half_width": h} for h in (1e-3, 1e-2, 1e-1)]
    assert _crossing(shapes, [0.25, 0.0625, 0.05], "half_width") == pytest.approx(1e-4)
    assert _crossing(shapes, [20.0, 16.0, 4.0], "half_width") == pytest.approx(1.0)


def test_what_no_parameter_would_show_is_unknown() -> None:
    assert _crossing([*PLAY.shapes], [4.0, 4.0], "half_width") is None
    assert _crossing([{"half_width": 1e-4}], [4.0], "half_width") is None
