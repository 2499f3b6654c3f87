"""Plan files: sensors, costs and budget, and every fault with its line and remedy."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.io.problems import FileProblems
from railui.planning.plan_file import RUN, load_plan, read_plan_fields
from railui.vehicle.design_reader import load_design
from tests.planning.files import nominal_design, plan_file, plan_text

ROOT = Path(__file__).parents[2]
SENSORS = {"rf": "0.3 mrad/s", "ayf": "0.02 m/s^2"}


def test_the_sensors_are_the_responses_with_a_stated_noise() -> None:
    plan = plan_file(SENSORS, "costs: {run: 3, rf: 0.5}\nbudget: 12\n")
    assert plan.sensors == ("ayf", "rf")
    assert (plan.cost(RUN), plan.cost("rf"), plan.cost("ayf"), plan.budget) == (3.0, 0.5, 1.0, 12.0)
    assert plan.campaign.noise["rf"] == pytest.approx(3e-4)
    assert len(plan.campaign.estimated_parameters) == 17


def test_noise_of_the_command_line_replaces_that_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "plan.yaml").write_text(plan_text(SENSORS))
    plan = load_plan(tmp_path / "plan.yaml", nominal_design(), {"rf": "1 mrad/s", "d1": "0.1 mm"})
    assert plan.campaign.noise["rf"] == pytest.approx(1e-3)
    assert plan.sensors == ("ayf", "rf", "d1")


def test_every_fault_is_reported_with_its_line_and_remedy(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    path.write_text("noise: {ayf: 0, rf: 0.3 mrad/s, ayx: 1}\ncosts: {run: 3, d9: 2}\nband: [30, 2]\nsensor: 1\n")
    with pytest.raises(FileProblems) as caught:
        load_plan(path, nominal_design())
    text = "\n".join(map(str, caught.value.problems))
    assert "plan.yaml:1" in text and "noise.ayx" in text and "noise.ayf" in text
    assert "plan.yaml:2" in text and "costs.d9" in text
    assert "its lower limit 30 Hz is not below its upper limit 2 Hz" in text
    assert "plan.yaml:4" in text and "sensor" in text
    assert all(problem.remedy for problem in caught.value.problems)


def test_settings_that_do_not_go_together_are_reported(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    path.write_text(plan_text(SENSORS, "settings: {bootstrap_draws: 200}\n"))
    for read in (read_plan_fields, lambda file: load_plan(file, nominal_design())):
        with pytest.raises(FileProblems, match=r"200 bootstrap_draws do not resolve a level of 0\.01"):
            read(path)


def test_a_rig_has_no_runs_on_a_track(tmp_path: Path) -> None:
    (tmp_path / "plan.yaml").write_text("noise: {z: 0.1}\n")
    rig = load_design(ROOT / "designs/campaigns/mr_damper/vehicle.yaml")
    with pytest.raises(FileProblems, match="no track excites"):
        load_plan(tmp_path / "plan.yaml", rig)
