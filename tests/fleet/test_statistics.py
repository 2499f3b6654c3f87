"""Hierarchical model, filter, control by sisters, and courses against hand formulas."""

from __future__ import annotations

import numpy as np
import pytest

from railui.fleet.control import common_deviation
from railui.fleet.course import arrival, fit_course
from railui.fleet.level_filter import Levels
from railui.fleet.mixed_model import QuantityRuns, fit_mixed_model


def test_the_mixed_model_separates_temperature_trend_vehicles_and_sections() -> None:
    rng = np.random.default_rng(3)
    vehicles, blocks, sections = 30, 20, 2
    vehicle = np.tile(np.arange(vehicles), blocks)
    block = np.repeat(np.arange(blocks), vehicles)
    cell = 2 * block + vehicle % sections
    degrees = (10.0 * np.sin(block / 3.0))[:, None]
    covariates = np.hstack([degrees, rng.uniform(-0.5, 0.5, (len(block), 1))])
    use = block / 20.0
    level, common = 0.05 * rng.standard_normal(vehicles), 0.03 * rng.standard_normal(cell.max() + 1)
    y = 1.0 - 0.004 * degrees[:, 0] + 0.1 * covariates[:, 1] + 0.2 * use + level[vehicle] + common[cell]
    y += 0.02 * rng.standard_normal(len(y))
    runs = QuantityRuns(y, np.full(len(y), 0.02), covariates, use, vehicle, cell, (vehicles, len(common)))
    found = fit_mixed_model(runs, iterations=20)
    assert np.abs(found.fixed - [1.0, -0.004, 0.1, 0.2]) == pytest.approx(0.0, abs=4.0 * found.fixed_sd.max())
    assert found.variance == pytest.approx(1.0, rel=0.2)
    assert np.sqrt(found.level_variance) == pytest.approx(0.05, rel=0.4)
    assert np.sqrt(found.cell_variance) == pytest.approx(0.03, rel=0.4)
    assert np.corrcoef(found.level, level)[0, 1] > 0.98


def test_a_vehicle_with_few_runs_is_pulled_towards_the_fleet() -> None:
    """With equal variances, a vehicle of one run keeps s_a^2 / (s_a^2 + s^2) of its deviation."""
    levels = Levels(*(np.array([[x]]) for x in (0.0, 0.0, 4.0, 0.0, 0.0)))
    one = levels.update(np.zeros((1, 1)), np.array([[1.0]]), np.array([[1.0]]), 10.0)
    assert one.a[0, 0] == pytest.approx(0.8)
    assert one.aa[0, 0] == pytest.approx(0.8)


def test_the_filter_of_many_blocks_is_weighted_least_squares() -> None:
    rng = np.random.default_rng(1)
    use, sd = np.linspace(0.0, 1.0, 12), 0.1
    y = 2.0 + 0.5 * use + sd * rng.standard_normal(12)
    levels = Levels(*(np.array([[x]]) for x in (0.0, 0.0, 1e6, 0.0, 1e6)))
    for m, value in zip(use, y, strict=True):
        levels = levels.update(np.array([[m]]), np.array([[value]]), np.array([[sd**2]]), 1e9)
    slope, level = np.polyfit(use, y, 1)
    assert [levels.a[0, 0], levels.b[0, 0]] == pytest.approx([level, slope], abs=1e-4)


def test_what_all_vehicles_have_in_common_is_no_deviation_of_one() -> None:
    """Twenty sisters moved by one: the common part is found, and one faulty sister hardly changes it."""
    deviation = np.full((20, 1), 1.0)
    deviation[0] = 30.0
    variance, prior = np.full((20, 1), 0.01), np.full((1, 1), 1.0)
    found, left = common_deviation(deviation, variance, prior, np.ones((1, 20)))
    assert found[0, 0] == pytest.approx(1.0, abs=0.03)
    assert left[0, 0] == pytest.approx(0.01 / 19, rel=0.1)


def test_without_sisters_nothing_is_subtracted() -> None:
    found, left = common_deviation(np.ones((2, 1)), np.ones((2, 1)), np.full((1, 1), 0.3), np.zeros((1, 2)))
    assert (found[0, 0], left[0, 0]) == (0.0, pytest.approx(0.3))


def test_onset_rate_and_arrival_of_a_ramp() -> None:
    t = np.arange(0.0, 200.0, 7.0)
    y = np.maximum(t - 90.0, 0.0) * -1e-3
    course = fit_course(t, y + 2e-3 * np.random.default_rng(0).standard_normal(len(t)), np.full(len(t), 2e-3))
    assert course is not None
    assert course.onset_low <= 90.0 <= course.onset_high
    assert course.rate == pytest.approx(-1e-3, abs=3.0 * course.rate_sd)
    reached = arrival(course, -0.2, np.inf)
    assert reached.low <= 290.0 <= reached.high
    assert reached.probability > 0.99
    assert not np.isfinite(arrival(course, -np.inf, 0.2).day)


def test_two_values_are_no_course() -> None:
    assert fit_course(np.array([0.0, 1.0]), np.zeros(2), np.ones(2)) is None


def test_the_interval_of_an_arrival_contains_the_day_as_often_as_stated() -> None:
    rng = np.random.default_rng(3)
    t, onset, rate, sd, base_sd = np.arange(20.0), 5.3, 0.4, 0.2, 0.15
    hits = {base_sd: 0, 0.0: 0}
    for _ in range(300):
        base = base_sd * rng.standard_normal()
        y = base + rate * np.maximum(t - onset, 0.0) + sd * rng.standard_normal(t.size)
        limit = 8.0 + base  # of the true value, from the level that was estimated
        for stated in hits:
            course = fit_course(t, y, np.full(t.size, sd), stated)
            assert course is not None
            found = arrival(course, -np.inf, limit)
            hits[stated] += found.low <= onset + 8.0 / rate <= found.high
    assert 0.85 < hits[base_sd] / 300 < 0.96


def test_a_course_that_is_no_ramp_has_a_misfit() -> None:
    t, sd = np.arange(20.0), np.full(20, 0.1)
    ramp, steps = fit_course(t, np.maximum(t - 5.0, 0.0), sd), fit_course(t, 2.0 * (t > 5) + 6.0 * (t > 15), sd)
    assert ramp is not None and ramp.probability > 0.99
    assert steps is not None and steps.probability < 1e-6
