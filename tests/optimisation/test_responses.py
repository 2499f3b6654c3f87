"""Responses of a design: the same numbers as those of ride, stability and curve."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.curving import curve
from railui.optimisation.cases import cases_of
from railui.optimisation.evaluation import evaluate_in_process
from railui.optimisation.objectives import assess
from railui.optimisation.response_keys import NUMERIC_KEYS, RESPONSE_KEYS
from railui.optimisation.responses import ANALYSES, MAX_SPEED, linear_damping
from railui.ride_quality.evaluation import ride
from railui.running_stability.summary import DEFAULT_SPEEDS, stability
from railui.vehicle.design_reader import load_design
from railui.vehicle.model import Model
from tests.optimisation.studies import CHECK_BOGIE, small_study


def test_objectives_of_stability_and_curve_are_the_results_of_the_analyses(tmp_path: Path) -> None:
    keys = ["linear_critical_speed", "fold_speed", "practical_critical_speed", "guiding_force", "wear_number"]
    objectives = ", ".join(f"{{minimise: {key}}}" for key in keys)
    cases = "{track: [erri_b176_low length=200], speed: [40], scenario: [{}], radius: 500 m, cant_deficiency: 80 mm}"
    study = small_study(tmp_path, CHECK_BOGIE, objectives=f"[{objectives}]", constraints="[]", cases=cases)
    x = np.array([[study.design.value(v.path) for v in study.variables]])
    values = assess(study, cases_of(study), x, evaluate_in_process(1)).objectives[0]
    speeds = stability(study.design, DEFAULT_SPEEDS, fold=True, track=study.cases.track[0], jobs=1)
    equilibrium = curve(study.design, 500.0, 0.08)
    expected = [MAX_SPEED if speeds[key] is None else speeds[key] for key in keys[:3]]
    expected += [max(map(abs, equilibrium["guiding_force"])), equilibrium["wear_number"]]
    assert values == pytest.approx(expected, rel=1e-12)


def test_every_numeric_key_belongs_to_an_analysis() -> None:
    assert set(ANALYSES) == {RESPONSE_KEYS[key].analysis for key in NUMERIC_KEYS}


def test_linear_damping_is_the_ratio_of_the_least_damped_mode() -> None:
    model = Model(load_design(CHECK_BOGIE))
    hunting = linear_damping(model, model.row[None], 60.0)[0]
    assert hunting == pytest.approx(0.34808 / np.hypot(0.34808, 30.17447), rel=1e-4)
    roots = model.eigenvalues(20.0)[0]  # at this speed a mode of the frame is damped less than hunting
    assert linear_damping(model, model.row[None], 20.0)[0] == min(-roots.real / np.abs(roots)) < 0.15
    assert linear_damping(model, model.row[None], 62.0)[0] < 0


def test_objectives_of_running_safety_are_those_of_a_ride(tmp_path: Path) -> None:
    keys = ["safety_share", "largest_derailment_quotient", "largest_sum_of_guiding_forces"]
    objectives = ", ".join(f"{{minimise: {key}}}" for key in keys)
    cases = "{track: [erri_b176_high length=300], speed: [40], scenario: [{}]}"
    study = small_study(tmp_path, CHECK_BOGIE, objectives=f"[{objectives}]", constraints="[]", cases=cases)
    x = np.array([[study.design.value(v.path) for v in study.variables]])
    values = assess(study, cases_of(study), x, evaluate_in_process(1)).objectives[0]
    found = ride(study.design, study.cases.track[0], 40.0)
    assert values == pytest.approx([found[key] for key in keys], rel=1e-12)
