"""Cases of a study: seeds, parameter samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.execution.outputs import study_text
from railui.io.problems import FileProblems
from railui.optimisation.cases import cases_of, seeds_of, used_seeds
from railui.optimisation.evaluation import response_table
from railui.optimisation.study_reader import load_study
from tests.optimisation.studies import BOGIE, HOME, small_study


def test_a_track_file_has_no_seeds_and_the_seed_of_a_spec_is_the_default(tmp_path: Path) -> None:
    run = HOME / "designs/campaigns/worn_axle_box/run_a.csv.gz"
    study = small_study(tmp_path, cases=f"{{track: [{run}, erri_b176_low length=200 seed=9], speed: [40]}}")
    spec = study.cases.track[1]
    assert seeds_of(study, str(run)) == [None]
    assert seeds_of(study, spec) == [9]
    assert seeds_of(study, spec, fresh=0) == [10]


def test_a_seed_that_the_study_names_replaces_that_of_the_spec_also_0(tmp_path: Path) -> None:
    spec = "erri_b176_low length=200 seed=7"
    named = small_study(tmp_path, cases=f"{{track: [{spec}], speed: [40], seed: [0]}}")
    assert seeds_of(named, spec) == [0] == used_seeds(named) and cases_of(named)[0].excitation.source.seed == 0
    (tmp_path / "copy.yaml").write_text(study_text(named, tmp_path), "utf-8")
    assert used_seeds(load_study(tmp_path / "copy.yaml")) == [0]
    left = small_study(tmp_path, cases=f"{{track: [{spec}, erri_b176_low length=200], speed: [40]}}")
    assert used_seeds(left) == [7, 0]
    (tmp_path / "copy.yaml").write_text(study_text(left, tmp_path), "utf-8")
    assert used_seeds(load_study(tmp_path / "copy.yaml")) == [7, 0]


def test_a_designed_line_has_the_seeds_of_its_synthetic_irregularities(tmp_path: Path) -> None:
    text = "schema: railui.line/1\nsegments: [{kind: straight, length: 200 m}]\n"
    (tmp_path / "rough.yaml").write_text(f"{text}irregularity: erri_b176_low seed=9\n")
    (tmp_path / "smooth.yaml").write_text(text)
    study = small_study(tmp_path, cases="{track: [rough.yaml, smooth.yaml], speed: [40]}")
    assert seeds_of(study, "rough.yaml") == [9] and seeds_of(study, "smooth.yaml") == [None]
    first, second = (cases_of(study, fresh=k)[0].excitation.source for k in (0, 1))
    assert (first.seed, second.seed) == (10, 11)
    assert not np.array_equal(first.track.yw, second.track.yw)
    study = small_study(tmp_path, cases="{track: [rough.yaml], speed: [40], seed: [1, 2], scenario: [{}]}")
    one, two = (case.excitation.track for case in cases_of(study))
    assert not np.array_equal(one.yw, two.yw)


def test_each_parameter_sample_is_a_case_with_its_own_result(tmp_path: Path) -> None:
    adjusted = tmp_path / "adjusted.yaml"
    names = "[contact.leading.conicity, vehicle.secondary.yaw_damping]"
    text = f"adjustment: {{campaign: c, names: {names}, covariance: [[1.0e-4, 0], [0, 1.0e+6]]}}\n"
    adjusted.write_text(BOGIE.read_text("utf-8") + text, "utf-8")
    cases = "{track: [erri_b176_low length=200], speed: [40], scenario: [{}], draws: 3}"
    study = small_study(tmp_path, adjusted, cases=cases)
    scores = response_table(cases_of(study), np.array([[3e4, 3e4]]), ["score"]).values["score"]
    assert scores.shape == (1, 3) and np.ptp(scores) > 0


SAMPLED = """adjustment:
  campaign: c
  names: [contact.leading.conicity, contact.trailing.conicity, vehicle.secondary.yaw_damping]
  covariance: [[1.0e-4, 0, 0], [0, 1.0e-4, 0], [0, 0, 1.0e+6]]
  samples: [[0.01, 0.02, 2000], [-0.01, -0.02, 1000]]
"""


def test_numbers_that_the_study_sets_have_no_error_of_estimation(tmp_path: Path) -> None:
    adjusted = tmp_path / "adjusted.yaml"
    adjusted.write_text(BOGIE.read_text("utf-8") + SAMPLED, "utf-8")
    cases = "{track: [erri_b176_low length=200], speed: [40], scenario: [{contact.leading.conicity: 0.3}], draws: 2}"
    study = small_study(tmp_path, adjusted, cases=cases)
    assert "vehicle.secondary.yaw_damping" in [variable.path for variable in study.variables]
    drawn = [case.vehicle.deviations for case in cases_of(study)]
    assert sorted(one["contact.trailing.conicity"] for one in drawn) == [-0.02, 0.02]
    assert all(one.keys() == {"contact.trailing.conicity"} for one in drawn)


def test_more_draws_than_the_vehicle_has_samples_are_refused(tmp_path: Path) -> None:
    adjusted = tmp_path / "adjusted.yaml"
    adjusted.write_text(BOGIE.read_text("utf-8") + SAMPLED, "utf-8")
    with pytest.raises(FileProblems, match="the vehicle has 2 samples of its parameters, give 2 or fewer"):
        small_study(tmp_path, adjusted, cases="{track: [erri_b176_low length=200], speed: [40], draws: 3}")
