"""Designs on fresh seeds: paired differences, constraints that are missed, designs that fail, parameter samples."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import ttest_rel

from railui.arrays import FloatArray
from railui.optimisation.cases import cases_of, has_seeds
from railui.optimisation.evaluation import evaluate_in_process
from railui.optimisation.fresh import FRESH_SEED_SETS, evaluate_fresh, fresh_warnings, is_significant, paired_difference
from railui.optimisation.objectives import assess
from railui.optimisation.optimise import optimise
from railui.optimisation.study import Study
from tests.optimisation.studies import BOGIE, CHECK_BOGIE, HOME, small_study

TIGHT_CASES = "{track: [erri_b176_low length=600], speed: [40 m/s], seed: [1], scenario: [{}]}"
DRAWN_CASES = "{track: [TRACK], speed: [40], seed: [1], scenario: [{}], draws: 2}"


def on_fresh_sets(study: Study, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return objectives [set, design, objective] and constraints, every set evaluated by itself."""
    evaluator = evaluate_in_process(1)
    sets = [assess(study, cases_of(study, fresh=k), x, evaluator) for k in range(FRESH_SEED_SETS)]
    return np.stack([one.objectives for one in sets]), np.stack([one.constraints for one in sets])


def front_of(result: dict[str, Any]) -> FloatArray:
    return np.array([list(point["variables"].values()) for point in result["pareto"]])


def drawn_vehicle(directory: Path) -> Path:
    """Return a design whose conicity is an estimate with a standard deviation of 0.01."""
    path = directory / "adjusted.yaml"
    text = "adjustment: {campaign: c, names: [contact.leading.conicity], covariance: [[1.0e-4]]}\n"
    path.write_text(BOGIE.read_text("utf-8") + text, "utf-8")
    return path


def test_differences_on_the_same_tracks_are_tested_as_pairs(tmp_path: Path) -> None:
    study = small_study(tmp_path)
    result = optimise(study, jobs=1)
    front, knee = front_of(result), result["knee"]
    assert knee is not None and len(front) > 1
    other = 0 if knee else len(front) - 1
    objectives, _ = on_fresh_sets(study, front[[other, knee]])
    difference = result["pareto"][other]["fresh"]["minus_knee"]
    expected = ttest_rel(objectives[:, 0], objectives[:, 1])
    paired = objectives[:, 0] - objectives[:, 1]
    assert difference["mean"] == pytest.approx(paired.mean(axis=0), rel=1e-9)
    assert difference["standard_error"] == pytest.approx(paired.std(axis=0, ddof=1) / np.sqrt(8), rel=1e-9)
    assert difference["p_value"] == pytest.approx(expected.pvalue, rel=1e-6)
    # far smaller than the standard deviation of one set, and significant all the same
    sd = result["pareto"][other]["fresh"]["sd"]
    assert abs(difference["mean"][0]) < 0.5 * sd[0] and is_significant(difference["p_value"][0])
    assert result["pareto"][knee]["fresh"]["minus_knee"]["mean"] == [None, None]
    assert result["baseline"]["fresh"]["minus_baseline"]["mean"] == [None, None]


def test_rounding_is_no_spread_and_no_difference() -> None:
    """Objectives that no seed changes: the first of both designs the same but for rounding, the second not."""
    rounding = 1e-16 * np.arange(8)
    first = np.stack([0.2 + rounding, 0.1 + rounding], axis=1)
    second = np.stack([np.full(8, 0.2), np.full(8, 0.3)], axis=1)
    difference = paired_difference(np.stack([first, second], axis=1), 0, 1)
    assert difference["mean"] == [0.0, pytest.approx(-0.2)] and difference["standard_error"] == [0.0, 0.0]
    assert [is_significant(p) for p in difference["p_value"]] == [False, True]


def test_a_constraint_met_by_a_hair_is_counted_and_warned_of_on_fresh_seeds(tmp_path: Path) -> None:
    variables = (
        "{vehicle.primary.lateral_stiffness: [1 MN/m, 8 MN/m], vehicle.primary.longitudinal_stiffness: [3e6, 2e7], "
        "vehicle.secondary.yaw_damping: [5e3, 2e5]}"
    )
    study = small_study(
        tmp_path,
        variables=variables,
        cases=TIGHT_CASES,
        objectives="[{minimise: wear_number, over: worst}]",
        constraints='["linear_damping >= 0.05", "flange_margin >= 4.6"]',
        method="{kind: cmaes, population: 8, generations: 10, seed: 1}",
    )
    result = optimise(study, jobs=1)
    best = result["pareto"][0]
    assert 4.6 <= best["constraints"][1] < 4.65
    _, constraints = on_fresh_sets(study, front_of(result))
    met = (constraints[:, 0, 1] >= 4.6).sum()
    assert best["fresh"]["met"] == [8, met] and met < 8
    assert best["fresh"]["constraints"] == pytest.approx(constraints[:, 0].min(axis=0))
    assert f"the best design meets flange_margin >= 4.6 in only {met} of 8 sets of fresh seeds" in result["warnings"]


def test_a_design_that_fails_on_fresh_seeds_is_counted_with_its_reason(tmp_path: Path) -> None:
    cases = "{track: [erri_b176_high length=600], speed: [70 m/s], seed: [1]}"
    study = small_study(tmp_path, CHECK_BOGIE, cases=cases)
    x = np.array([[study.design.value(variable.path) for variable in study.variables], [2e5, 6e4]])
    summary = evaluate_fresh(study, x, evaluate_in_process(1)).summary(0, 1, None)
    failed = summary["failed"]
    assert failed > 0 and summary["failures"] == {"left the track": failed}
    assert summary["mean"] == [None, None] == summary["minus_baseline"]["mean"]
    assert summary["met"][0] <= 8 - failed
    warnings = fresh_warnings(study, [{"fresh": summary}] * 2, {0: "the knee"})
    assert warnings[0] == f"the knee fails in {failed} of 8 sets of fresh seeds: left the track"
    assert warnings[-1] == "2 of 2 designs of the front fail or miss a constraint on fresh seeds"


def test_every_fresh_set_has_parameter_samples_of_its_own(tmp_path: Path) -> None:
    cases = DRAWN_CASES.replace("TRACK", "erri_b176_low length=300")
    study = small_study(tmp_path, drawn_vehicle(tmp_path), cases=cases)
    drawn = [[case.vehicle.deviations for case in cases_of(study, fresh=k)] for k in (None, *range(8))]
    values = {value for deviations in drawn for sample in deviations for value in sample.values()}
    assert len(values) == 9 * 2
    assert [case.vehicle.deviations for case in cases_of(study, fresh=3)] == drawn[4]


def test_samples_make_fresh_sets_of_track_files_too(tmp_path: Path) -> None:
    run = HOME / "designs/campaigns/worn_axle_box/run_a.csv.gz"
    cases = DRAWN_CASES.replace("TRACK", str(run))
    study = small_study(tmp_path, drawn_vehicle(tmp_path), cases=cases)
    assert has_seeds(cases_of(study))
    assert not has_seeds(cases_of(small_study(tmp_path, cases=cases.replace("draws: 2", "draws: 0"))))
