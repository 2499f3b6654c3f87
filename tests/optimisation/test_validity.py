"""Notes and warnings on what the responses of a study leave out."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from railui.curving.evaluation import curve
from railui.optimisation.cases import cases_of, vehicles_of
from railui.optimisation.optimise import baseline_values, optimise
from railui.optimisation.validity import flange_warnings, linear_notes
from tests.optimisation.studies import BOGIE, small_study

CASES = "{track: [erri_b176_low length=200], speed: [40], scenario: [{}], radius: 600 m, cant_deficiency: 100 mm}"
WEAR = '["wear_number <= 200"]'


def bogie_with(directory: Path, effects: str) -> Path:
    path = directory / "bogie.yaml"
    path.write_text(BOGIE.read_text("utf-8") + f"effects: [{effects}]\n", "utf-8")
    return path


def test_a_curve_beyond_the_clearance_without_a_flange_is_warned_of_before_and_after_the_search(tmp_path: Path) -> None:
    assert max(map(abs, curve(BOGIE, 600.0, 0.1)["displacement"])) > 0.007  # "not credible"
    study = small_study(tmp_path, cases=CASES, constraints=WEAR)
    [warning] = [str(each) for each in study.warnings if "not credible" in str(each)]
    assert "e in the curve (radius 600 m, cant deficiency 100 mm) is beyond the flange clearance" in warning
    result = optimise(study, jobs=1)
    assert any(text.startswith("e of the baseline") and "not credible" in text for text in result["warnings"])


def test_a_vehicle_with_flanges_or_within_the_clearance_is_not_warned_of(tmp_path: Path) -> None:
    held = small_study(tmp_path, bogie_with(tmp_path, "{kind: flange_contact}"), cases=CASES, constraints=WEAR)
    wide = small_study(tmp_path, cases=CASES.replace("600 m", "20 km").replace("100 mm", "0"), constraints=WEAR)
    straight = small_study(tmp_path, cases=CASES, constraints='["linear_damping >= 0"]')
    for study in (held, wide, straight):
        baseline = np.atleast_2d(baseline_values(study))[0]
        assert flange_warnings(study, {"baseline": vehicles_of(cases_of(study), baseline)}) == []
        assert not any("not credible" in str(each) for each in study.warnings)


def test_linear_keys_name_the_effects_that_they_lack(tmp_path: Path) -> None:
    play = bogie_with(tmp_path, "{kind: free_play, at: primary_lateral, half_width: 0.4 mm}")
    study = small_study(tmp_path, play, cases=CASES, constraints='["linear_damping >= 0.05"]')
    assert linear_notes(study) == ["linear_damping: linear: without free_play"]
    assert linear_notes(small_study(tmp_path, cases=CASES, constraints='["linear_damping >= 0.05"]')) == []
    assert linear_notes(small_study(tmp_path, play, cases=CASES, constraints="[]")) == []
