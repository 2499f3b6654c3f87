"""A loop that meets a data fault stops before any fit, or corrects it and goes on."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from railui.api import loop as loop_of_package
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.report.loop import data_faults
from railui.report.loop.data_faults import data_fault_report, examine_data, write_data_fault
from tests.blind.simulated import simulated_campaign
from tests.truth.campaign import write


@pytest.fixture
def flipped(tmp_path: Path) -> Path:
    """A simulated campaign whose gyro is mounted the wrong way."""
    truth = simulated_campaign().truth
    for run in truth.runs.values():
        run["rf"] = -run["rf"]
    try:
        write(truth, tmp_path)
    finally:
        for run in truth.runs.values():
            run["rf"] = -run["rf"]
    return tmp_path


def test_the_loop_stops_without_a_simulation_and_names_the_correction(
    flipped: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loop_of_package, "close_loop", lambda *a, **k: pytest.fail("the loop began"))
    report = loop_of_package.loop(flipped)
    assert (report["verdict"], report["effects"], report["simulations"]) == ("data", [], 0)
    assert "rf has the wrong sign" in report["sentence"]
    (row,) = report["corrections"]
    assert (row["channel"], row["yaml"], row["applied"]) == ("rf", "sensors: {rf: {gain: -1}}", False)


def test_the_report_of_a_stopped_loop_has_every_key(flipped: Path, report: dict[str, Any]) -> None:
    stopped = data_fault_report(examine_data(read_dataset(load_campaign(flipped))))
    assert set(stopped) == set(report)
    for key in ("before", "floor", "explained", "remainder", "test"):
        assert set(stopped[key]) == set(report[key]), key


def test_a_corrected_dataset_is_that_of_the_sound_campaign(flipped: Path) -> None:
    checked = examine_data(read_dataset(load_campaign(flipped)), correct=True)
    assert (checked.is_corrected, checked.is_stopped, checked.remaining.serious) == (True, False, ())
    sound = simulated_campaign().dataset
    for ours, theirs in zip(checked.dataset.segments, sound.segments, strict=True):
        assert all((ours.columns[c] == theirs.columns[c]).all() for c in theirs.columns)


def test_accepted_faults_are_listed_and_do_not_stop(flipped: Path) -> None:
    checked = examine_data(read_dataset(load_campaign(flipped)), accept_data=True)
    assert not checked.is_stopped and not checked.is_corrected
    (row,) = data_faults.correction_rows(checked)
    assert row["serious"] and not row["applied"]


def test_the_files_of_a_stopped_loop_hold_the_corrected_campaign(flipped: Path, tmp_path: Path) -> None:
    checked = examine_data(read_dataset(load_campaign(flipped)))
    report = data_fault_report(checked)
    directory = tmp_path / "out"
    write_data_fault(checked, report, directory, ["a line"])
    assert json.loads((directory / "loop.json").read_text())["verdict"] == "data"
    assert "gain: -1" in (directory / "report.html").read_text()
    again: Dataset = read_dataset(load_campaign(directory / "campaign.yaml"))
    assert examine_data(again).found.faults == ()
