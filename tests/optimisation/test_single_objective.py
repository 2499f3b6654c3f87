"""Single-objective search: merit and coordinate search."""

from __future__ import annotations

import numpy as np
import pytest

from railui.optimisation.objectives import PENALTY, Assessment
from railui.optimisation.single_objective import coordinate_search, merit
from railui.optimisation.study import Objective
from tests.optimisation.assessments import DAMPING, assessment, plain_study


@pytest.mark.parametrize("sense", ["minimise", "maximise"])
def test_a_feasible_design_has_a_better_merit_than_any_infeasible_one(sense: str) -> None:
    study = plain_study(Objective("score", sense, "mean"), constraints=(DAMPING,))
    sign = 1.0 if sense == "minimise" else -1.0
    objectives = sign * np.array([[9.0], [5.0], [1.0], [0.0]])
    merits = merit(study, assessment(objectives, np.array([[0.05], [0.06], [0.04], [0.01]])))
    assert merits[:2].tolist() == [9.0, 5.0]
    assert merits[2] == pytest.approx(1.2 * PENALTY) and merits[3] == pytest.approx(1.8 * PENALTY)


def test_the_coordinate_search_descends_an_oblique_valley_to_its_minimum() -> None:
    def valley(x: np.ndarray) -> Assessment:
        u, v = x[:, 0] - 0.3, np.log10(x[:, 1]) / 2.0 - 0.8  # the range of b is logarithmic
        return assessment((u * u + v * v + 1.5 * u * v)[:, None])

    study = plain_study(Objective("score", "minimise", "mean"))
    generations = list(coordinate_search(study, np.array([0.9, 2.0]), valley))
    best = [float(valley(generation.front).objectives[0, 0]) for generation in generations]
    assert best == sorted(best, reverse=True)
    assert generations[-1].front[0] == pytest.approx([0.3, 10**1.6], rel=5e-3)
