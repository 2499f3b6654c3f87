"""Front of a search: every feasible design tried, thinned without losing its ends and its knee."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymoo.indicators.hv import HV

from railui.arrays import FloatArray
from railui.optimisation import optimise as optimisation
from railui.optimisation.front import Front, front_size, nondominated, thin
from railui.optimisation.knee import find_knee
from railui.optimisation.search import Search
from railui.optimisation.study import Objective
from tests.optimisation.assessments import assessment, plain_study
from tests.optimisation.studies import small_study

CASES = "{track: [erri_b176_low length=300], speed: [40 m/s], seed: [1], scenario: [{}]}"
VARIABLES = (
    "{vehicle.primary.lateral_stiffness: [1 MN/m, 8 MN/m], vehicle.primary.longitudinal_stiffness: [3e6, 2e7], "
    "vehicle.secondary.yaw_damping: [5e3, 2e5]}"
)
OBJECTIVES = (
    "[{minimise: weighted_acceleration}, {maximise: flange_margin, over: worst}, "
    "{maximise: linear_damping, over: worst}, {minimise: wear_number, over: worst}]"
)
SIGNS = np.array([1.0, -1.0, -1.0, 1.0])


@pytest.fixture(scope="module")
def searched(tmp_path_factory: pytest.TempPathFactory) -> tuple[FloatArray, dict[str, Any]]:
    """Minimised objectives of all designs tried, and the result."""
    method = "{kind: nsga3, population: 12, generations: 8, seed: 1}"
    parts = {"cases": CASES, "variables": VARIABLES, "objectives": OBJECTIVES, "method": method}
    study = small_study(tmp_path_factory.mktemp("four"), **parts, constraints='["linear_damping >= 0.02"]')
    tried: list[FloatArray] = []
    with pytest.MonkeyPatch.context() as patch:
        record = Search._record

        def recorded(search: Search, generation: Any) -> None:
            feasible = generation.assessment.constraints[:, 0] >= 0.02
            tried.append(generation.assessment.objectives[feasible] * SIGNS)
            record(search, generation)

        patch.setattr(Search, "_record", recorded)
        result = optimisation.optimise(study, jobs=1)
    return np.vstack(tried), result


def delivered(result: dict[str, Any]) -> FloatArray:
    return np.array([point["objectives"] for point in result["pareto"]]) * SIGNS


def _front_of(tried: FloatArray) -> FloatArray:
    unique = np.unique(tried, axis=0)
    return np.asarray(unique[nondominated(unique)])


def test_no_feasible_design_tried_beats_one_of_the_front(searched: tuple[FloatArray, dict[str, Any]]) -> None:
    tried, result = searched
    for design in delivered(result):
        assert not (np.all(tried <= design, axis=1) & np.any(tried < design, axis=1)).any()


def test_the_best_value_tried_of_every_objective_is_delivered(searched: tuple[FloatArray, dict[str, Any]]) -> None:
    tried, result = searched
    front = delivered(result)
    assert np.array_equal(front.min(axis=0), tried.min(axis=0))
    whole = _front_of(tried)
    assert result["nondominated"] == len(whole) > len(front) == 12
    assert np.array_equal(front[result["knee"]], whole[find_knee(whole).index])
    assert result["knee_plane"]["distance"] == pytest.approx(find_knee(whole).distance)


def test_the_hypervolume_is_that_of_the_front_delivered(searched: tuple[FloatArray, dict[str, Any]]) -> None:
    tried, result = searched
    fronts = [_front_of(tried[: row["evaluations"]]) for row in result["hypervolume"]]  # every design is feasible
    corners = np.vstack(fronts)
    low, width = corners.min(axis=0), np.ptp(corners, axis=0)
    volume = HV(ref_point=np.ones(4))
    last = result["hypervolume"][-1]
    assert last["hypervolume"] == pytest.approx(float(volume((delivered(result) - low) / width)))
    assert last["tried"] == pytest.approx(float(volume((fronts[-1] - low) / width)))
    assert last["hypervolume"] < last["tried"]


def test_a_front_kept_from_generation_to_generation_is_that_of_all_designs() -> None:
    rng = np.random.default_rng(5)
    study = plain_study(*(Objective(key, "minimise", "mean") for key in ("a", "b", "c")))
    generations = [np.round(rng.uniform(size=(20, 3)), 1) for _ in range(10)]  # many are equal
    front = Front.empty(study)
    for number, costs in enumerate(generations):
        x = np.stack([np.full(20, float(number)), np.arange(20.0)], axis=1)
        front = front.including(Front(x, assessment(costs), costs))
    tried = np.vstack(generations)
    assert np.array_equal(np.unique(front.costs, axis=0), _front_of(tried)) and len(front) == len(_front_of(tried))
    for (number, i), costs in zip(front.x.astype(int), front.costs, strict=True):
        earlier = np.all(tried[: 20 * number + i] == costs, axis=1)
        assert np.array_equal(generations[number][i], costs) and not earlier.any()  # of equal designs the first


def test_a_front_is_thinned_evenly_and_keeps_ends_and_knee() -> None:
    rng = np.random.default_rng(3)
    points = np.abs(rng.normal(size=(400, 3)))
    front = points / np.linalg.norm(points, axis=1)[:, None] * -1.0  # the best values are on a sphere
    kept = thin(front, 20)
    assert len(kept) == len(set(kept.tolist())) == 20
    for values in front.T:
        assert {int(np.argmin(values)), int(np.argmax(values))} <= set(kept.tolist())
    assert find_knee(front).index in kept
    assert np.array_equal(front[kept][find_knee(front[kept]).index], front[find_knee(front).index])
    apart = np.linalg.norm(front[kept][:, None] - front[kept], axis=2)[~np.eye(20, dtype=bool)]
    hole = np.min(np.linalg.norm(front[:, None] - front[kept], axis=2), axis=1).max()
    assert hole < 0.35 and apart.min() > 0.02


def test_the_size_of_a_front_is_the_population_or_that_of_its_ends(tmp_path: Path) -> None:
    assert front_size(small_study(tmp_path)) == 8
    four = small_study(tmp_path, objectives=OBJECTIVES, method="{kind: nsga3, population: 4, generations: 1}")
    assert front_size(four) == 9
