"""CUSUM tests: run lengths against published and simulated ones."""

from __future__ import annotations

import numpy as np
import pytest

from railui.campaign.settings.declaration import Setting
from railui.campaign.settings.fleet import FLEET_SETTINGS
from railui.fleet.cusum import run_length, step, threshold_of_rate


@pytest.mark.parametrize(("threshold", "published"), [(4.0, 336.0), (5.0, 930.0)])
def test_the_run_length_is_that_of_published_tables(threshold: float, published: float) -> None:
    """Two-sided run lengths 168 and 465 with k = 1/2 (Montgomery, table 9.3) are half the one-sided ones."""
    assert run_length(threshold, 0.5) == pytest.approx(published, rel=0.02)


def test_the_stated_rate_of_false_alarms_holds_on_normal_scores() -> None:
    rng = np.random.default_rng(0)
    tests, per_month, rate, vehicles, months = 6, 4.0, 0.2, 400, 40
    limit = threshold_of_rate(rate, tests, per_month, 0.5)
    up = down = np.zeros((vehicles, tests))
    alarms = 0
    for _ in range(int(months * per_month)):
        up, down = step(up, down, rng.standard_normal((vehicles, tests)), 0.5)
        over = (np.maximum(up, down) > limit).any(axis=1)
        alarms += int(over.sum())
        up, down = np.where(over[:, None], 0.0, up), np.where(over[:, None], 0.0, down)
    assert alarms / (vehicles * months) == pytest.approx(rate, rel=0.15)


def test_a_score_that_is_not_known_changes_nothing() -> None:
    up, down = step(np.array([2.0]), np.array([1.0]), np.array([np.nan]), 0.5)
    assert (up[0], down[0]) == (2.0, 1.0)


def test_a_rise_adds_to_the_upper_sum_alone() -> None:
    up, down = step(np.array([1.0]), np.array([1.0]), np.array([2.0]), 0.5)
    assert (up[0], down[0]) == (2.5, 0.0)


@pytest.mark.parametrize("setting", FLEET_SETTINGS.values(), ids=list(FLEET_SETTINGS))
def test_each_setting_of_a_fleet_has_a_meaning_and_bounds(setting: Setting) -> None:
    assert setting.meaning[0].isupper() and setting.meaning.endswith(".") and len(setting.meaning.split()) > 3
    assert setting.minimum is None or setting.minimum <= setting.default
    assert setting.maximum is None or setting.default <= setting.maximum
