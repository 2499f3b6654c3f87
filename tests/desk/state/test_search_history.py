"""Front of a search so far: kept from generation to generation, equal to that of all designs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from railui.desk.presenters.front_columns import front_columns, front_table
from railui.desk.presenters.front_plot import front_plot
from railui.desk.presenters.parallel_plot import parallel_plot
from railui.desk.presenters.search_history import GenerationSummary, SearchHistory, restore_search, search_content
from railui.desk.presenters.search_plots import baseline_comparison, convergence_plot, design_text, fresh_text
from railui.desk.state.plan import Plan
from railui.optimisation.front import nondominated
from railui.optimisation.knee import Knee, knee_warnings
from railui.vehicle.design_reader import load_design
from tests.desk.conftest import REPOSITORY


def generation(rng: np.random.Generator, number: int, plan: Plan) -> GenerationSummary:
    """Return a generation of twelve designs, two thirds of them feasible; some objectives are equal."""
    x = rng.uniform(size=(12, len(plan.bounds)))
    objectives = np.round(rng.uniform(size=(12, len(plan.objectives))), 1)
    limits = rng.uniform(size=(12, len(plan.constraints)))
    empty = np.full(len(plan.objectives), np.nan), np.full(len(plan.constraints), np.nan)
    return GenerationSummary(x, objectives, limits, rng.uniform(size=12) < 2 / 3, 12 * number, 0, "", *empty)


@pytest.mark.parametrize("seed", range(5))
def test_the_front_is_that_of_all_feasible_designs(seed: int) -> None:
    plan = Plan.for_design(load_design(REPOSITORY / "designs/test_bogie.yaml"), "erri_b176_low", 40.0)
    rng, history = np.random.default_rng(seed), SearchHistory(plan)
    assert len(history.front()[1]) == 0
    for number in range(1, 9):
        assert history.add(generation(rng, number, plan))
        every = history.feasible_objectives()
        best = nondominated(every * history.objective_signs)
        x, objectives = history.front()
        assert {*map(tuple, x)} == {*map(tuple, history.feasible_designs()[best])}
        assert np.all(np.diff(objectives[:, 0] * history.objective_signs[0]) >= 0.0)
    restored = restore_search(plan, search_content(history))
    assert np.array_equal(restored.front()[0], history.front()[0])


def test_the_best_value_of_a_single_objective_search_never_rises() -> None:
    plan = Plan.for_design(load_design(REPOSITORY / "designs/test_bogie.yaml"), "erri_b176_low", 40.0)
    plan = replace(plan, objectives=[next(each for each in plan.objectives if each[0].startswith("minimise"))])
    history = SearchHistory(plan)
    for number, value in enumerate((3.0, 1.0, 2.0, np.nan), 1):
        empty = np.full(1, np.nan), np.full(len(plan.constraints), np.nan)
        limits, is_feasible = np.zeros((1, len(plan.constraints))), np.array([np.isfinite(value)])
        x = np.zeros((1, len(plan.bounds)))
        history.add(GenerationSummary(x, np.array([[value]]), limits, is_feasible, number, 0, "", *empty))
    assert convergence_plot(history).lines[0].y.tolist() == [3.0, 1.0, 1.0, 1.0]


@pytest.mark.parametrize(("track", "reason"), [("line.csv", "track files"), ("erri_b176_low", "failed on new seeds")])
def test_a_front_without_spread_has_its_reason(track: str, reason: str) -> None:
    plan = Plan.for_design(load_design(REPOSITORY / "designs/test_bogie.yaml"), track, 40.0)
    history = SearchHistory(plan)
    unknown = [None] * len(plan.objectives)
    history.result = {"pareto": [{"fresh": {"mean": unknown, "sd": unknown}}]}
    assert reason in fresh_text(history, 0)


def test_the_difference_from_the_baseline_names_what_is_not_significant_and_what_is_missed() -> None:
    plan = Plan.for_design(load_design(REPOSITORY / "designs/test_bogie.yaml"), "erri_b176_low", 40.0)
    plan = replace(plan, objectives=plan.objectives[:2], constraints=("linear_damping >= 0.05", "wear_number <= 100"))
    history = SearchHistory(plan)
    paired = {"mean": [-0.0121, 0.4], "standard_error": [0.0031, 0.9], "p_value": [0.006, 0.67]}
    fresh = {"mean": [0.2, 4.0], "sd": [0.1, 1.0], "sets": 8, "met": [8, 5], "minus_baseline": paired}
    history.result = {"pareto": [{"fresh": fresh}]}
    heading, first, second, missed = baseline_comparison(history, 0, 40).splitlines()
    assert heading.split(maxsplit=2)[:2] == ["minus", "baseline"]
    assert first.endswith(" -0.0121±0.0031") and second.endswith(" 0.40±0.90 n.s.")
    assert missed.split() == ["wear", "number", "<=", "100", "met", "on", "5", "of", "8"]
    assert all(len(line) <= 24 for line in baseline_comparison(history, 0, 24).splitlines())


def test_a_design_of_the_front_has_the_number_of_the_warnings_and_of_choose() -> None:
    plan = Plan.for_design(load_design(REPOSITORY / "designs/test_bogie.yaml"), "erri_b176_low", 40.0)
    plan = replace(plan, objectives=plan.objectives[:2], constraints=())
    history, fresh = SearchHistory(plan), {"mean": [None, None], "sd": [None, None]}
    pareto = [
        {"variables": dict.fromkeys(plan.bounds, 1.0 + i), "objectives": [1.0 + i, 2.0 + i], "fresh": fresh}
        for i in range(3)
    ]
    history.result = {"pareto": [row | {"constraints": []} for row in pareto], "knee": 1, "warnings": []}
    columns = front_columns(history)
    assert front_table(history, columns)[0].cells == ("0", "1 knee", "2")
    assert design_text(history, 1).startswith("1: ")
    (warning,) = knee_warnings(Knee(1, "ends", 0.0), 3, 2)
    for data in (front_plot(history, columns, 0, 1, 1), parallel_plot(columns, [0, 1, 2], 1)):
        (label,) = {each.label for each in (*data.lines, *data.marks) if each.label.startswith("design ")}
        assert label in warning
