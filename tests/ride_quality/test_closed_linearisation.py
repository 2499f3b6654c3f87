"""Linearisation over the motion of the linearised vehicle: fixed point, agreement with the table, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from railui.cli import cli
from railui.io.problems import FileProblems
from railui.ride_quality.closed_linearisation import close_linearisation, ridden_deviations
from railui.ride_quality.evaluation import excitation_of
from railui.vehicle.design_reader import load_design

DESIGNS = Path(__file__).parents[2] / "designs"
PROFILED = load_design(DESIGNS / "profiled_bogie.yaml")
EXCITATION = excitation_of("erri_b176_high length=2000 seed=1", 40.0)


def test_the_fixed_point_reproduces_itself_and_the_ride_with_the_table() -> None:
    result = close_linearisation(PROFILED, EXCITATION)
    assert result.has_converged and 2 <= len(result.steps) <= 10
    overrides = result.document()["linearised_overrides"]
    again = PROFILED.with_values(overrides)
    assert again.values == result.design.values and again.effects == result.design.effects
    ridden = ridden_deviations(again, EXCITATION)
    for group in ("leading", "trailing"):
        assert ridden[group] == pytest.approx(again.value(f"contact.profiles.{group}.sd"), rel=1e-3)
        assert result.table_sd is not None
        assert ridden[group] == pytest.approx(result.table_sd[group], rel=0.05)
    assert ridden["leading"] > 1.2 * ridden["trailing"]
    assert again.values["contact.leading.conicity"] != again.values["contact.trailing.conicity"]


def test_another_start_ends_at_the_same_motion() -> None:
    ends = [close_linearisation(PROFILED.with_values({"contact.profiles.sd": sd}), EXCITATION) for sd in (1e-3, 4e-3)]
    for group in ("leading", "trailing"):
        assert ends[0].steps[-1].sd[group] == pytest.approx(ends[1].steps[-1].sd[group], rel=3e-3)


def test_one_pass_linearises_over_the_sd_of_the_design() -> None:
    result = close_linearisation(PROFILED, EXCITATION, once=True)
    (only,) = result.steps
    assert dict(only.sd) == {"leading": 2e-3, "trailing": 2e-3}
    assert only.parameters["leading"]["conicity"] == PROFILED.values["contact.leading.conicity"]


def test_a_design_whose_contact_does_not_follow_profiles_is_refused() -> None:
    with pytest.raises(FileProblems, match="no profiles"):
        close_linearisation(load_design(DESIGNS / "test_bogie.yaml"), EXCITATION)
    with pytest.raises(FileProblems, match="gives its conicities itself"):
        close_linearisation(PROFILED.detached(), EXCITATION)


def test_the_command_prints_the_passes() -> None:
    words = [
        "contact",
        str(DESIGNS / "profiled_bogie.yaml"),
        "contact.profiles.gauge=1433 mm",
        "vehicle.wheel_load=60e3",
    ]
    words += ["--track", "erri_b176_high length=800 seed=1", "--speed", "40", "--json", "-"]
    found = json.loads(CliRunner().invoke(cli, [*words, "-q"]).stdout)
    assert found["overrides"] == {"contact.profiles.gauge": "1433 mm", "vehicle.wheel_load": "60e3"}
    assert found["has_converged"] and found["groups"] == ["leading", "trailing"]
    assert found["iterations"][-1]["ridden_sd"] == pytest.approx(found["iterations"][-1]["sd"], rel=1e-3)
    refused = CliRunner().invoke(cli, [*words[:2], "--track", "erri_b176_high"])
    assert refused.exit_code == 2 and "--track and --speed" in refused.stderr
    misplaced = CliRunner().invoke(cli, ["contact", "a.txt", "b.txt", "vehicle.wheel_load=1"])
    assert misplaced.exit_code == 2 and "belong to a design" in misplaced.stderr
