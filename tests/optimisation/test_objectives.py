"""Objectives and constraints: aggregation over cases, violations, warnings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.optimisation.objectives import PENALTY, aggregate, result_warnings, violations
from railui.optimisation.study import Objective
from tests.optimisation.assessments import DAMPING, WEAR, assessment, plain_study
from tests.optimisation.studies import small_study


def test_values_over_cases_are_aggregated_towards_the_bad_side() -> None:
    values = np.arange(21.0)[None]
    assert aggregate(values, Objective("score", "minimise", "p95"))[0] == pytest.approx(19.0)
    assert aggregate(values, Objective("score", "maximise", "p95"))[0] == pytest.approx(1.0)
    assert aggregate(values, Objective("score", "maximise", "worst"))[0] == 0.0
    assert aggregate(values, Objective("score", "minimise", "mean"))[0] == 10.0


def test_violations_are_relative_and_an_earlier_failure_is_worse() -> None:
    constraints = np.array([[0.06, 100.0], [0.04, 300.0], [0.05, 200.0], [0.05, 200.0]])
    designs = assessment(np.zeros((4, 1)), constraints, np.array([1.0, 1.0, 0.25, 0.5]))
    expected = np.array([[-0.2, -0.5, -1.0], [0.2, 0.5, -1.0], [0.0, 0.0, 1.75], [0.0, 0.0, 1.5]])
    assert violations(plain_study(constraints=(DAMPING, WEAR)), designs) == pytest.approx(expected)


def test_an_unknown_value_violates_every_constraint() -> None:
    designs = assessment(np.zeros((1, 1)), np.array([[np.nan]]))
    assert violations(plain_study(constraints=(DAMPING,)), designs)[0, 0] == PENALTY


def test_stiff_primaries_without_a_curve_and_an_optimum_at_a_bound_give_warnings(tmp_path: Path) -> None:
    study = small_study(tmp_path, variables="{vehicle.primary.lateral_stiffness: [3 MN/m, 5 MN/m]}")
    inside = result_warnings(study, np.array([[0.5]]), 0)
    at_bound = result_warnings(study, np.array([[0.995]]), 0)
    assert len(inside) == 1 and "no objective or constraint evaluates a curve" in inside[0]
    assert "the upper bound of vehicle.primary.lateral_stiffness, 5 MN/m" in at_bound[0]
