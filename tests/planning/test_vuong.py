"""Vuong's test: by hand, and its level where both models predict equally well."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from railui.campaign.settings.planning import PlanningSettings
from railui.planning.vuong import vuong_statistic


def test_the_statistic_is_the_mean_difference_over_its_standard_error() -> None:
    first, second = np.array([1.0, 2.0, 3.0]), np.array([2.0, 4.0, 6.0])
    # differences 1, 2, 3: mean 2, sample deviation 1
    assert vuong_statistic(first, second) == pytest.approx(sqrt(3.0) * 2.0)
    assert vuong_statistic(second, first) == pytest.approx(-sqrt(3.0) * 2.0)


def test_equal_errors_decide_nothing() -> None:
    assert vuong_statistic(np.ones(5), np.ones(5)) == 0.0
    assert vuong_statistic(np.ones(1), np.zeros(1)) == 0.0


def test_models_that_predict_equally_well_are_separated_at_the_stated_level() -> None:
    settings = PlanningSettings()
    assert settings.critical_z == pytest.approx(1.6449, abs=1e-4)
    rng = np.random.default_rng(4)
    z = [vuong_statistic(*rng.standard_normal((2, 40)) ** 2) for _ in range(4000)]
    assert np.mean(np.array(z) > settings.critical_z) == pytest.approx(settings.separation_level, abs=0.012)


def test_a_model_that_must_leave_its_estimates_pays_for_the_distance() -> None:
    same = np.ones(20)
    # 16 = 4^2 standard deviations, of which the variance is 4 times 16
    assert vuong_statistic(same, same, (0.0, 16.0)) == pytest.approx(16.0 / 8.0)
    assert vuong_statistic(same, same, (0.5, 0.5)) == 0.0


def test_the_distance_of_a_wrong_estimate_is_rarely_mistaken() -> None:
    rng = np.random.default_rng(6)
    same = np.ones(10)
    # both estimates are right: their distances are squares of standard normal variables
    z = [vuong_statistic(same, same, tuple(rng.standard_normal(2) ** 2)) for _ in range(4000)]
    assert np.mean(np.array(z) > PlanningSettings().critical_z) < 0.05
