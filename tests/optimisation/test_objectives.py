"""What a search compares designs by: limits exceeded, the merit of one aim, the polish, means over rides."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from railui.optimisation.objectives import BAD, Assessed, violations
from railui.optimisation.optimise import COMPARED, _mean_quality
from railui.optimisation.single_objective import merit, polish
from railui.optimisation.study import Constraint, Objective, Variable
from railui.vehicle.design_reader import load_design
from railui.vehicle.model import Model
from railui.vehicle.sampling import ParameterisedModel

BOGIE = load_design(Path(__file__).parents[2] / "designs/test_bogie.yaml")
DAMPING, WEAR = Constraint("linear_damping", ">=", 0.05, ""), Constraint("wear_number", "<=", 200.0, "")


def study(*objectives: Objective, limits: tuple[Constraint, ...] = ()) -> Any:
    variables = (Variable("a", 0.0, 1.0, "1"), Variable("b", 1.0, 100.0, "1"))
    return SimpleNamespace(variables=variables, objectives=objectives, constraints=limits)


def judged(aims: np.ndarray, limits: np.ndarray | None = None, travelled: np.ndarray | None = None) -> Assessed:
    n = len(aims)
    return Assessed(aims, np.zeros((n, 0)) if limits is None else limits,
                  np.ones(n) if travelled is None else travelled, [""] * n)  # fmt: skip


def test_a_limit_is_exceeded_by_its_share_and_a_design_that_fails_sooner_is_worse() -> None:
    limits = np.array([[0.06, 100.0], [0.04, 300.0], [0.05, 200.0], [0.05, 200.0]])
    found = violations(study(limits=(DAMPING, WEAR)), judged(np.zeros((4, 1)), limits, np.array([1.0, 1.0, 0.25, 0.5])))
    assert found == pytest.approx(np.array([[-0.2, -0.5, -1.0], [0.2, 0.5, -1.0], [0.0, 0.0, 1.75], [0.0, 0.0, 1.5]]))


def test_what_is_not_known_exceeds_every_limit() -> None:
    found = violations(study(limits=(DAMPING,)), judged(np.zeros((1, 1)), np.array([[np.nan]])))
    assert found[0, 0] == BAD


@pytest.mark.parametrize("sense", ["minimise", "maximise"])
def test_a_design_that_keeps_the_limits_has_more_merit_than_any_that_does_not(sense: str) -> None:
    one, sign = study(Objective("score", sense, "mean"), limits=(DAMPING,)), 1.0 if sense == "minimise" else -1.0
    aims, damping = sign * np.array([[9.0], [5.0], [1.0], [0.0]]), np.array([[0.05], [0.06], [0.04], [0.01]])
    found = merit(one, judged(aims, damping))
    assert found[:2].tolist() == [9.0, 5.0]
    assert found[2] == pytest.approx(1.2 * BAD) and found[3] == pytest.approx(1.8 * BAD)


def test_the_polish_goes_down_a_slanting_valley_to_its_lowest_place() -> None:
    def valley(x: np.ndarray) -> Assessed:
        u, v = x[:, 0] - 0.3, np.log10(x[:, 1]) / 2.0 - 0.8  # b is walked by its logarithm
        return judged((u * u + v * v + 1.5 * u * v)[:, None])

    generations = list(polish(study(Objective("score", "minimise", "mean")), np.array([0.9, 2.0]), valley))
    bests = [float(valley(one.front).objectives[0, 0]) for one in generations]
    assert bests == sorted(bests, reverse=True)
    assert generations[-1].front[0] == pytest.approx([0.3, 10**1.6], rel=5e-3)


def test_riding_quality_over_cases_is_the_mean_with_the_worst_class() -> None:
    good = dict.fromkeys(COMPARED, 2.0) | {"class": "good", "decided_by": "score"}
    poor = dict.fromkeys(COMPARED, 4.0) | {"class": "not admissible", "decided_by": "flange contact", "wz": None}
    found = _mean_quality([good, poor])
    assert (found["class"], found["decided_by"]) == ("not admissible", "flange contact")
    assert found["score"] == 3.0 and found["wz"] is None


def test_a_deviation_is_added_to_what_stands_there_and_kept_inside_what_a_file_may_say() -> None:
    conicity, mass = "contact.leading.conicity", "vehicle.frame.mass"
    varied = ParameterisedModel(Model(BOGIE), (conicity,), {conicity: 0.02, mass: -1e6})
    rows, columns = varied.rows(np.array([[0.1], [0.3]])), varied.model.columns
    assert rows[:, columns[conicity]] == pytest.approx([0.12, 0.32])
    assert rows[:, columns[mass]] == pytest.approx(0.01 * BOGIE.value(mass))
