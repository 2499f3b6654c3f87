"""Optimisation of a vehicle, end to end on small studies."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.documents.saving import save_design
from railui.io.problems import FileProblems
from railui.optimisation.cases import seeds_of
from railui.optimisation.optimise import RIDE_QUALITY_KEYS, mean_ride_quality, optimise
from railui.optimisation.scenarios import friction_paths
from railui.optimisation.study import Study
from railui.ride_quality.evaluation import ride
from railui.vehicle.design_reader import load_design
from railui.vehicle.effects import PlacedEffect
from tests.optimisation.studies import BOGIE, CHECK_BOGIE, small_study


def objectives_by_ride(study: Study, variables: dict[str, float], seeds: Sequence[int | None]) -> list[float]:
    """Return mean weighted acceleration and worst flange margin of a design from single simulations."""
    rides = [
        ride(study.design.with_values({**variables, **scenario}), study.cases.track[0], 40.0, seed=seed)
        for seed in seeds
        for scenario in study.cases.scenario
    ]
    mean = float(np.mean([result["weighted_acceleration"] for result in rides]))
    return [mean, min(result["flange_margin"] for result in rides)]


def json_without_time(result: dict[str, Any]) -> str:
    return json.dumps({key: value for key, value in result.items() if key != "seconds"})


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, dict[str, Any]]:
    study = small_study(tmp_path_factory.mktemp("small"))
    return study, optimise(study, jobs=1)


def test_the_same_seed_gives_the_same_result_on_any_number_of_threads(small: tuple[Study, dict[str, Any]]) -> None:
    study, result = small
    assert json_without_time(optimise(study, jobs=2)) == json_without_time(result)
    assert json_without_time(optimise(study, seed=2)) != json_without_time(result)


def test_objectives_are_those_of_single_simulations_over_all_cases(small: tuple[Study, dict[str, Any]]) -> None:
    study, result = small
    for point in (result["pareto"][0], result["baseline"]):
        expected = objectives_by_ride(study, point["variables"], (1, 2))
        assert point["objectives"] == pytest.approx(expected, rel=1e-12)


def test_no_design_on_the_front_dominates_another(small: tuple[Study, dict[str, Any]]) -> None:
    f = np.array([point["objectives"] for point in small[1]["pareto"]]) * [1, -1]
    assert len(f) > 1 and not any(np.all(a >= b) and np.any(a > b) for a in f for b in f)
    assert np.all(np.diff(f[:, 0]) >= 0)


def test_the_front_meets_the_constraints_and_evaluations_are_counted(small: tuple[Study, dict[str, Any]]) -> None:
    study, result = small
    assert result["evaluations"] == 24 and result["cases"] == 4
    for point in result["pareto"]:
        assert point["constraints"][0] >= 0.02
        for variable in study.variables:
            assert variable.lowest <= point["variables"][variable.path] <= variable.highest


def test_the_front_is_evaluated_again_on_seeds_not_used_by_the_search(small: tuple[Study, dict[str, Any]]) -> None:
    study, result = small
    fresh = [seeds_of(study, study.cases.track[0], k) for k in range(8)]
    assert not {1, 2} & {s for seeds in fresh for s in seeds} and len({s for f in fresh for s in f}) == 16
    point = result["pareto"][0]
    objectives = np.array([objectives_by_ride(study, point["variables"], seeds) for seeds in fresh])
    assert point["fresh"]["mean"] == pytest.approx(objectives.mean(axis=0), rel=1e-9)
    assert point["fresh"]["sd"] == pytest.approx(objectives.std(axis=0, ddof=1), rel=1e-6)


def test_without_a_feasible_design_the_nearest_is_reported(tmp_path: Path) -> None:
    result = optimise(small_study(tmp_path, constraints='["linear_damping >= 0.9"]'))
    assert result["pareto"] == [] and result["knee"] is None
    assert set(result["closest"]) == set(result["baseline"]["variables"])
    assert result["baseline"]["constraints"][0] < 0.9 and result["riding"]["after"] is None


def test_designs_that_leave_the_track_fail_and_are_counted(tmp_path: Path) -> None:
    cases = "{track: [erri_b176_high length=600], speed: [70 m/s], seed: [1]}"
    result = optimise(small_study(tmp_path, CHECK_BOGIE, cases=cases, constraints="[]"))
    assert result["failed"] > 0 and result["pareto"]
    assert result["baseline"]["objectives"] == [None, None]
    assert all(value is not None for point in result["pareto"] for value in point["objectives"])


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"objectives": "[{minimise: n_mv}]"}, "n_mv needs 300 s"),
        ({"variables": "{riding.journey: [1 h, 4 h]}"}, "is a criterion of the assessment"),
        ({"variables": "{contact.leading.conicity: [0.1, 0.4]}"}, "is a variable and also set in a scenario"),
    ],
)
def test_a_study_that_cannot_be_searched_is_refused(tmp_path: Path, parts: dict[str, str], message: str) -> None:
    with pytest.raises(FileProblems, match=message):
        optimise(small_study(tmp_path, **parts))


def test_a_friction_is_not_both_a_variable_and_set_in_a_scenario(tmp_path: Path) -> None:
    design = load_design(BOGIE)
    saturation = PlacedEffect("creep_saturation", "contact", None, {"friction": 0.35})
    design = design.with_effects([*design.effects, saturation])
    save_design(design, tmp_path / "vehicle.yaml")
    cases = "{track: [erri_b176_low length=300], speed: [40 m/s], scenario: [{contact.friction: 0.2}]}"
    variables = f"{{{friction_paths(design)[-1]}: [0.1, 0.5]}}"
    with pytest.raises(FileProblems, match="is a variable and also set in a scenario"):
        optimise(small_study(tmp_path, tmp_path / "vehicle.yaml", cases=cases, variables=variables))


def test_a_design_too_stiff_to_integrate_fails_without_the_others(tmp_path: Path) -> None:
    variables = "{vehicle.primary.lateral_stiffness: [1 MN/m, 1e7 MN/m]}"
    result = optimise(small_study(tmp_path, variables=variables, constraints="[]"))
    assert 0 < result["failed"] < result["evaluations"] and result["pareto"]
    stiff = load_design(BOGIE).with_values({"vehicle.primary.lateral_stiffness": 1e13})
    save_design(stiff, tmp_path / "stiff.yaml")
    result = optimise(small_study(tmp_path, tmp_path / "stiff.yaml", constraints="[]"))
    assert result["baseline"]["objectives"] == [None, None] and result["riding"]["before"] is None
    assert result["pareto"] == [] and result["failed"] == result["evaluations"]
    changes = [row["objectives"] for row in result["sensitivities"]["one_at_a_time"]]
    assert changes and all(row == [None, None] for row in changes)


def test_ride_quality_over_cases_is_the_mean_with_the_worst_class() -> None:
    good = dict.fromkeys(RIDE_QUALITY_KEYS, 2.0) | {"class": "good", "decided_by": "score", "safety_share": 0.4}
    poor = dict.fromkeys(RIDE_QUALITY_KEYS, 4.0) | {
        "class": "not admissible",
        "decided_by": "flange contact",
        "wz": None,
        "safety_share": 1.2,
    }
    result = mean_ride_quality([good, poor])
    assert (result["class"], result["decided_by"]) == ("not admissible", "flange contact")
    assert result["score"] == 3.0 and result["wz"] is None and result["safety_share"] == 1.2
