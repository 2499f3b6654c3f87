"""The search for better suspensions, end to end on small studies."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.curving import curve
from railui.documents.saving import save_design
from railui.hunting.summary import SPEEDS, stability
from railui.io.problems import FileProblems
from railui.optimisation.cases import cases_of, seeds_of
from railui.optimisation.design_space import Ranges, first_generation
from railui.optimisation.evaluation import evaluate_in_process, response_table
from railui.optimisation.multi_objective import knee
from railui.optimisation.objectives import aggregate, assess, warnings_for
from railui.optimisation.optimise import optimise
from railui.optimisation.response_keys import NUMBERS, RESULTS
from railui.optimisation.responses import HIGHEST, RESPONSES, linear_damping
from railui.optimisation.study import Objective, Study, Variable, load_study
from railui.ride_quality.evaluation import ride
from railui.vehicle.design_reader import load_design
from railui.vehicle.model import Model
from railui.vehicle.sampling import ParameterisedModel, draws

HOME = Path(__file__).parents[2]
BOGIE = HOME / "designs/test_bogie.yaml"
STUDY = """\
name: small
vehicle: {vehicle}
variables: {variables}
cases: {cases}
objectives: {objectives}
constraints: {constraints}
method: {{kind: nsga2, population: 8, generations: 3, seed: 1}}
"""
USUAL = {
    "variables": "{vehicle.secondary.yaw_damping: [5 kN*m*s/rad, 200 kN*m*s/rad], "
    "vehicle.secondary.lateral_damping: [10e3, 60e3]}",
    "cases": "{track: [erri_b176_low length=300], speed: [40 m/s], seed: [1, 2], "
    "scenario: [{}, {contact.leading.conicity: 0.3, contact.trailing.conicity: 0.3}]}",
    "objectives": "[{minimise: weighted_acceleration, over: mean}, {maximise: flange_margin, over: worst}]",
    "constraints": '["linear_damping >= 0.02"]',
}


def study(home: Path, vehicle: Path = BOGIE, **parts: str) -> Study:
    path = home / "study.yaml"
    path.write_text(STUDY.format(**USUAL | parts, vehicle=vehicle), "utf-8")
    return load_study(path)


def aims_by_hand(one: Study, variables: dict[str, float], seeds: Sequence[int | None]) -> list[float]:
    """Mean weighted acceleration and worst flange margin of a design, ride by ride."""
    rides = [
        ride(one.design.with_values({**variables, **scenario}), one.cases.track[0], 40.0, seed=seed)
        for seed in seeds
        for scenario in one.cases.scenario
    ]
    mean = float(np.mean([r["weighted_acceleration"] for r in rides]))
    return [mean, min(r["flange_margin"] for r in rides)]


def told(result: dict[str, Any]) -> str:
    """A result without its time."""
    return json.dumps({key: value for key, value in result.items() if key != "seconds"})


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, dict[str, Any]]:
    one = study(tmp_path_factory.mktemp("small"))
    return one, optimise(one, jobs=1)


def test_the_same_seed_finds_the_same_front_on_any_threads(small: tuple[Study, dict[str, Any]]) -> None:
    one, found = small
    assert told(optimise(one, jobs=2)) == told(found)
    assert told(optimise(one, seed=2)) != told(found)


def test_objectives_are_the_rides_of_the_design_over_all_cases(small: tuple[Study, dict[str, Any]]) -> None:
    one, found = small
    for point in (found["pareto"][0], found["baseline"]):
        assert point["objectives"] == pytest.approx(aims_by_hand(one, point["variables"], (1, 2)), rel=1e-12)


def test_nothing_on_the_front_is_worse_than_another_in_every_aim(small: tuple[Study, dict[str, Any]]) -> None:
    f = np.array([point["objectives"] for point in small[1]["pareto"]]) * [1, -1]
    assert len(f) > 1 and not any(np.all(a >= b) and np.any(a > b) for a in f for b in f)
    assert np.all(np.diff(f[:, 0]) >= 0)


def test_limits_are_kept_on_the_front_and_evaluations_counted(small: tuple[Study, dict[str, Any]]) -> None:
    one, found = small
    assert found["evaluations"] == 24 and found["cases"] == 4
    for point in found["pareto"]:
        assert point["constraints"][0] >= 0.02
        for variable in one.variables:
            assert variable.lowest <= point["variables"][variable.path] <= variable.highest


def test_the_front_is_ridden_again_on_seeds_that_the_search_never_saw(
    small: tuple[Study, dict[str, Any]],
) -> None:
    one, found = small
    fresh = [seeds_of(one, one.cases.track[0], k) for k in range(8)]
    assert not {1, 2} & {s for seeds in fresh for s in seeds} and len({s for f in fresh for s in f}) == 16
    point = found["pareto"][0]
    aims = np.array([aims_by_hand(one, point["variables"], seeds) for seeds in fresh])
    assert point["fresh"]["mean"] == pytest.approx(aims.mean(axis=0), rel=1e-9)
    assert point["fresh"]["sd"] == pytest.approx(aims.std(axis=0, ddof=1), rel=1e-6)


def test_no_feasible_design_is_told_with_the_nearest(tmp_path: Path) -> None:
    found = optimise(study(tmp_path, constraints='["linear_damping >= 0.9"]'))
    assert found["pareto"] == [] and found["knee"] is None
    assert set(found["closest"]) == set(found["baseline"]["variables"])
    assert found["baseline"]["constraints"][0] < 0.9 and found["riding"]["after"] is None


def test_designs_that_leave_the_track_fail_and_are_counted(tmp_path: Path) -> None:
    cases = "{track: [erri_b176_high length=600], speed: [70 m/s], seed: [1]}"
    found = optimise(study(tmp_path, HOME / "designs/check_bogie.yaml", cases=cases, constraints="[]"))
    assert found["failed"] > 0 and found["pareto"]
    assert found["baseline"]["objectives"] == [None, None]
    assert all(value is not None for point in found["pareto"] for value in point["objectives"])


@pytest.mark.parametrize(
    ("parts", "what"),
    [
        ({"objectives": "[{minimise: n_mv}]"}, "n_mv needs 300 s"),
        ({"variables": "{riding.journey: [1 h, 4 h]}"}, "is what a design is judged by"),
        ({"variables": "{contact.leading.conicity: [0.1, 0.4]}"}, "is a variable and stands in a scenario"),
    ],
)
def test_what_cannot_be_searched_is_refused_at_its_place(tmp_path: Path, parts: dict[str, str], what: str) -> None:
    with pytest.raises(FileProblems, match=what):
        optimise(study(tmp_path, **parts))


def test_stiff_primaries_without_a_curve_and_an_optimum_on_a_bound_are_remarked(tmp_path: Path) -> None:
    one = study(tmp_path, variables="{vehicle.primary.lateral_stiffness: [3 MN/m, 5 MN/m]}")
    curve, bound = warnings_for(one, np.array([[0.5]]), 0), warnings_for(one, np.array([[0.995]]), 0)
    assert len(curve) == 1 and "no aim or limit looks at a curve" in curve[0]
    assert "the upper bound of vehicle.primary.lateral_stiffness, 5 MN/m" in bound[0]


def test_rows_are_those_of_the_design_with_its_values_defaults_of_effects_included() -> None:
    text = BOGIE.read_text("utf-8") + (
        "effects:\n  - {kind: flange_contact}\n"
        "  - {kind: cubic_stiffness, at: primary_lateral}\n"
        "  - {kind: free_play, at: primary_lateral, wheelset: 2, half_width: 0.3 mm}\n"
    )
    design = load_design(text)
    paths = ("vehicle.primary.lateral_stiffness", "contact.flange_clearance", "effects.2.half_width")
    x = np.array([[2e6, 5e-3, 1e-4], [7e6, 9e-3, 5e-4]])
    by_design = [Model(design.with_values(dict(zip(paths, one, strict=True)))).row for one in x]
    np.testing.assert_array_equal(ParameterisedModel(Model(design), paths).rows(x), by_design)


def test_draws_follow_the_covariance_of_the_adjustment(tmp_path: Path) -> None:
    adjusted = tmp_path / "adjusted.yaml"
    names = "[contact.leading.conicity, vehicle.secondary.yaw_damping]"
    text = f"adjustment: {{campaign: c, names: {names}, covariance: [[1.0e-4, 0], [0, 1.0e+6]]}}\n"
    adjusted.write_text(BOGIE.read_text("utf-8") + text, "utf-8")
    design = load_design(adjusted)
    found = draws(design, 200, [1])
    spread = np.std([list(one.values()) for one in found], axis=0)
    assert spread == pytest.approx([0.01, 1e3], rel=0.2)
    assert found[:5] == draws(design, 5, [1]) != draws(design, 5, [2])
    drawn = study(
        tmp_path,
        adjusted,
        cases="{track: [erri_b176_low length=200], speed: [40], scenario: [{}], draws: 3}",
    )
    numbers = response_table(cases_of(drawn), np.array([[3e4, 3e4]]), ["score"])
    assert numbers.values["score"].shape == (1, 3) and np.ptp(numbers.values["score"]) > 0


def test_a_draw_cannot_bring_a_stiffness_below_nothing() -> None:
    varied = ParameterisedModel(Model(load_design(BOGIE)), (), {"vehicle.geometry.half_wheelbase": -9.0})
    assert varied.rows(np.zeros((1, 0)))[0, varied.model.columns["vehicle.geometry.half_wheelbase"]] > 0


def test_every_number_of_ride_stability_and_curve_can_be_aimed_at_and_is_what_the_command_tells(
    tmp_path: Path,
) -> None:
    keys = ["linear_critical_speed", "fold_speed", "practical_critical_speed", "guiding_force", "wear_number"]
    aims = ", ".join(f"{{minimise: {key}}}" for key in keys)
    cases = "{track: [erri_b176_low length=200], speed: [40], scenario: [{}], radius: 500 m, cant_deficiency: 80 mm}"
    one = study(tmp_path, HOME / "designs/check_bogie.yaml", objectives=f"[{aims}]", constraints="[]", cases=cases)
    x = np.array([[one.design.value(v.path) for v in one.variables]])
    found = assess(one, cases_of(one), x, evaluate_in_process(1)).objectives[0]
    told = stability(one.design, SPEEDS, fold=True, track=one.cases.track[0], jobs=1)
    stood = curve(one.design, 500.0, 0.08)
    expected = [told[key] for key in keys[:3]] + [max(map(abs, stood["guiding_force"])), stood["wear_number"]]
    assert found == pytest.approx([HIGHEST if value is None else value for value in expected], rel=1e-12)
    assert set(RESPONSES) == {RESULTS[key].question for key in NUMBERS}


def test_linear_damping_is_the_ratio_of_the_least_damped_mode() -> None:
    model = Model(load_design(HOME / "designs/check_bogie.yaml"))
    hunting = linear_damping(model, model.row[None], 60.0)[0]
    assert hunting == pytest.approx(0.34808 / np.hypot(0.34808, 30.17447), rel=1e-4)
    roots = model.eigenvalues(20.0)[0]  # where the frame on its springs is damped less than hunting
    assert linear_damping(model, model.row[None], 20.0)[0] == min(-roots.real / np.abs(roots)) < 0.15
    assert linear_damping(model, model.row[None], 62.0)[0] < 0


def test_values_over_cases_are_aggregated_towards_the_bad_side() -> None:
    values = np.arange(21.0)[None]
    less, more = (Objective("score", sense, "p95") for sense in ("minimise", "maximise"))
    assert aggregate(values, less)[0] == pytest.approx(19.0)
    assert aggregate(values, more)[0] == pytest.approx(1.0)
    assert aggregate(values, Objective("score", "maximise", "worst"))[0] == 0.0
    assert aggregate(values, Objective("score", "minimise", "mean"))[0] == 10.0


def test_a_file_has_no_seeds_and_a_specs_own_seed_stands_where_none_are_given(tmp_path: Path) -> None:
    run = HOME / "designs/campaigns/worn_axle_box/run_a.csv.gz"
    cases = f"{{track: [{run}, erri_b176_low length=200 seed=9], speed: [40]}}"
    one = study(tmp_path, cases=cases)
    assert seeds_of(one, str(run)) == [None] and seeds_of(one, one.cases.track[1]) == [9]
    assert seeds_of(one, one.cases.track[1], fresh=0) == [10]


def test_the_first_generation_fills_every_stratum_and_holds_the_vehicle_as_it_is() -> None:
    ranges = Ranges([Variable("a", 1.0, 2.0, "1"), Variable("b", 1.0, 1000.0, "1")])
    found = first_generation(ranges, 16, np.array([1.5, 5000.0]), 1)
    assert np.array_equal(np.sort((16 * found).astype(int), axis=0), np.tile(np.arange(16), (2, 1)).T)
    inside = first_generation(ranges, 16, np.array([1.5, 10.0]), 1)
    assert inside[0] == pytest.approx([0.5, 1 / 3])
    assert ranges.unit(ranges.values(found)) == pytest.approx(found)


def test_the_knee_of_one_aim_is_its_best() -> None:
    assert knee(np.array([[3.0], [7.0]]), np.array([-1.0])) == 1


def test_a_design_too_stiff_to_be_stepped_fails_without_its_neighbours(tmp_path: Path) -> None:
    variables = "{vehicle.primary.lateral_stiffness: [1 MN/m, 1e7 MN/m]}"
    found = optimise(study(tmp_path, variables=variables, constraints="[]"))
    assert 0 < found["failed"] < found["evaluations"] and found["pareto"]
    stiff = load_design(BOGIE).with_values({"vehicle.primary.lateral_stiffness": 1e13})
    file = tmp_path / "stiff.yaml"
    save_design(stiff, file)
    found = optimise(study(tmp_path, file, constraints="[]"))
    assert found["baseline"]["objectives"] == [None, None] and found["riding"]["before"] is None
    assert found["pareto"] == [] and found["failed"] == found["evaluations"]
