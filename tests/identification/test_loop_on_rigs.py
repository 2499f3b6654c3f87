"""The closed loop on a rig, driven and free: it ends in a verdict, a report and its page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.identification.estimation.validation import estimate_noise_floor
from railui.identification.loop import close_loop, nominal_model
from railui.report.loop.data import loop_report
from railui.report.loop.files import write_loop
from tests.truth.effects import effect
from tests.truth.rig import Bench, write

FRICTION = effect("dry_friction", "rig", force=40.0, slip_speed=0.01)
SLOW = ("bump_stop", "maxwell_damper", "free_play", "hysteresis")  # left out so that the tests are fast


def measured(tmp_path: Path, **options: Any) -> Dataset:
    write(Bench(seconds=(3.0, 2.0), rate=500.0, **options), tmp_path)
    return read_dataset(load_campaign(tmp_path))


def reported(measurement: Dataset, directory: Path, without: Sequence[str]) -> tuple[dict[str, Any], str]:
    found = close_loop(measurement, without=without, jobs=1)
    write_loop(found, loop_report(found), directory, [])
    data = json.loads((directory / "loop.json").read_text())
    return data, (directory / "report.html").read_text()


@pytest.mark.parametrize("free", [False, True])
def test_a_loop_on_a_rig_without_effects_finds_none(tmp_path: Path, free: bool):
    data, page = reported(measured(tmp_path, seed=1, free=free), tmp_path / "out", SLOW)
    assert data["verdict"] == "none" and data["unexplained"] < 1.1
    assert data["sentence"].split(":")[0] in page


def test_a_loop_on_a_driven_rig_finds_its_friction(tmp_path: Path):
    data, page = reported(measured(tmp_path, seed=1, effects=[FRICTION]), tmp_path / "out", SLOW)
    assert data["verdict"] == "effect" and [e["kind"] for e in data["effects"]] == ["dry_friction"]
    assert data["effects"][0]["parameters"]["force"]["value"] == pytest.approx(40.0, rel=0.02)
    assert "dry friction" in page


@pytest.mark.parametrize("free", [False, True])
def test_a_loop_on_a_rig_barred_from_friction_ends_outside(tmp_path: Path, free: bool):
    barred = [*SLOW, "dry_friction", "quadratic_damper", "asymmetric_damper", "viscous_damper", "measured_force"]
    data, page = reported(measured(tmp_path, seed=1, free=free, effects=[FRICTION]), tmp_path / "out", barred)
    assert data["verdict"] == "outside" and data["outside"]["at"] == "rig"
    assert len(data["outside"]["motion"]) == len(data["outside"]["force"])
    assert "measured curve" in page


def test_noise_on_the_input_of_a_rig_raises_the_floor(tmp_path: Path):
    quiet = measured(tmp_path, seed=1)
    model = nominal_model(quiet)
    u = quiet.validation[0].columns["u"]
    noisy = Dataset(quiet.campaign, quiet.runs, quiet.segments, {**quiet.noise, "u": 0.1 * float(u.std())})
    low, high = (estimate_noise_floor(model, m, m.validation, seeds=4, jobs=1) for m in (quiet, noisy))
    assert low.nrmse == pytest.approx(low.sensors_only)
    assert high.nrmse > 1.5 * high.sensors_only
