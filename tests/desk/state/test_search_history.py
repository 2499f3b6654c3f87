"""Front of a search so far: kept from generation to generation, equal to that of all designs."""

from __future__ import annotations

import numpy as np
import pytest

from railui.desk.presenters.search_history import GenerationSummary, SearchHistory, restore_search, search_content
from railui.desk.state.plan import Plan
from railui.optimisation.multi_objective import nondominated
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
