"""Changes since an earlier campaign: the score of a change by hand and by simulation, and its sentence."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from railui.report.loop.changes import change_lines, change_score


def test_without_drift_the_score_is_that_of_two_independent_estimates() -> None:
    # before 10 +/- 1; new data alone 14 +/- 2: the difference is 4 +/- sqrt(5)
    sd_before, own = 1.0, 2.0
    sd = 1.0 / sqrt(1.0 / sd_before**2 + 1.0 / own**2)
    estimate = sd**2 * (10.0 / sd_before**2 + 14.0 / own**2)
    assert change_score(estimate - 10.0, sd, sd_before, sd_before) == pytest.approx(4.0 / sqrt(5.0))


def test_the_score_is_standard_normal_where_nothing_has_changed() -> None:
    rng = np.random.default_rng(1)
    truth, sd_before, own, prior_sd = 5.0, 0.3, 0.5, 0.8
    before = truth + sd_before * rng.standard_normal(20_000)
    data = truth + own * rng.standard_normal(20_000)
    sd = 1.0 / sqrt(1.0 / prior_sd**2 + 1.0 / own**2)
    after = sd**2 * (before / prior_sd**2 + data / own**2)
    z = np.array([change_score(d, sd, sd_before, prior_sd) for d in after - before])
    assert np.std(z) == pytest.approx(1.0, abs=0.02)


def test_data_that_add_nothing_have_no_score() -> None:
    assert change_score(0.1, 1.0, 1.0, 1.0) is None


def test_only_changes_beyond_chance_are_named() -> None:
    row = {"unit": "N/m", "before": 2.0e6, "sd_before": 1e4, "value": 1.5e6, "sd": 1e4}
    quiet = row | {"path": "a", "z": 1.0, "changed": False}
    report = {"prior": {"campaign": "spring", "changes": [quiet]}}
    assert change_lines(report) == ["Since spring: no estimate has changed beyond chance (1 % over all)."]
    report["prior"]["changes"].append(row | {"path": "vehicle.primary.lateral_stiffness", "z": -35.4, "changed": True})
    (line,) = change_lines(report)
    assert "vehicle.primary.lateral_stiffness 2.00 +/- 0.01 MN/m -> 1.50 +/- 0.01 MN/m (z = -35.4)" in line
    assert " a " not in line
    assert change_lines({"prior": None}) == []
