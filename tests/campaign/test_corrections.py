"""Corrections in the `sensors` entry of a campaign file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.corrections.correction import Correction
from railui.campaign.corrections.reading import read_corrections
from railui.campaign.dataset import read_dataset
from railui.documents.check import check
from railui.documents.saving import save_campaign
from railui.documents.schema import json_schema
from railui.io.problems import Findings, Problem

Problems = Callable[[Callable[[], object]], list[Problem]]


def campaign_with(folder: Path, sensors: str) -> Path:
    """Append a `sensors` entry to the campaign of a folder."""
    path = folder / "campaign.yaml"
    path.write_text(path.read_text() + f"sensors: {sensors}\n")
    return path


def test_corrections_are_read_with_units_beside_effects_and_saved_again(campaign_folder: Path) -> None:
    entry = (
        "{rf: {gain: -1}, e1: {delay: 80 ms, runs: [run_b.csv]}, track_offset: {run_a.csv: 0.3 m}, "
        "effects: [{kind: sensor_gain, at: e2, gain: 0.9}]}"
    )
    campaign = load_campaign(campaign_with(campaign_folder, entry))
    assert campaign.corrections.channels == (
        Correction("rf", gain=-1.0),
        Correction("e1", delay=0.08, runs=("run_b.csv",)),
    )
    assert campaign.corrections.track_offset == {"run_a.csv": 0.3}
    assert [s.at for s in campaign.sensors] == ["e2"]
    saved = load_campaign(save_campaign(campaign, campaign_folder / "saved.yaml"))
    assert (saved.corrections, saved.sensors) == (campaign.corrections, campaign.sensors)
    assert saved.corrections.track_offset == campaign.corrections.track_offset


@pytest.mark.parametrize(("header", "unit", "factor"), [
    ("V", "g", 9.80665), ("g", "g", 9.80665), ("g", "mm/s^2", 1e-3), ("m/s^2", "g", 9.80665), (None, "mg", 9.80665e-3)
])  # fmt: skip
def test_the_unit_of_a_sensor_replaces_that_of_the_header(
    campaign_folder: Path, header: str | None, unit: str, factor: float
) -> None:
    before = read_dataset(load_campaign(campaign_folder))
    run = campaign_folder / "run_b.csv"
    run.write_text(run.read_text().replace("ay1 [m/s^2]", f"ay1 [{header}]" if header else "ay1"))
    campaign_with(campaign_folder, f"{{ay1: {{unit: {unit}, runs: [run_b.csv]}}}}")
    after = read_dataset(load_campaign(campaign_folder))
    for old, new, gain in zip(before.runs, after.runs, (1.0, factor), strict=True):
        assert new.columns["ay1"] == pytest.approx(gain * old.columns["ay1"], rel=1e-12)
    assert not [p for p in check([campaign_folder]) if p.severity == "error"]


def test_noise_of_an_acceleration_may_be_in_g(campaign_folder: Path) -> None:
    path = campaign_folder / "campaign.yaml"
    path.write_text(path.read_text().replace("e1: 0.05 mm", "ay1: 0.01 g"))
    assert load_campaign(campaign_folder).noise["ay1"] == pytest.approx(0.0980665)


@pytest.mark.parametrize("kind", ["rig", "bench"])
def test_a_run_without_track_has_no_offset_of_its_track(kind: str) -> None:
    findings = Findings("campaign.yaml")
    corrections = read_corrections({"track_offset": "0.3 m"}, kind, ["run_a.csv"], findings)
    assert [p.message for p in findings.problems] == [f"a {kind} has no track"] and not corrections.track_offset


def test_every_wrong_correction_is_reported_at_its_key(campaign_folder: Path, problems_of: Problems) -> None:
    entry = (
        "{rff: {gain: -1}, e1: {dela: 80 ms}, ay1: {swap_with: e2, unit: kg}, track_offset: 3 s, "
        "yw: {leave_out: true}, d1: 3, d2: {gain: 0}, e2: {runs: [run_x.csv]}, rf: {gravity: 9.81}}"
    )
    problems = problems_of(lambda: load_campaign(campaign_with(campaign_folder, entry)))
    keys = {p.key: p for p in problems}
    assert set(keys) == {
        "sensors.rff",
        "sensors.e1.dela",
        "sensors.ay1.swap_with",
        "sensors.ay1.unit",
        "sensors.track_offset",
        "sensors.yw.leave_out",
        "sensors.d1",
        "sensors.d2.gain",
        "sensors.e2.runs",
        "sensors.rf.gravity",
    }
    assert (
        keys["sensors.rff"].remedy == "did you mean 'rf'?" and keys["sensors.e1.dela"].remedy == "did you mean 'delay'?"
    )
    assert all(p.line == len((campaign_folder / "campaign.yaml").read_text().splitlines()) for p in problems)


def test_the_json_schema_lists_the_keys_of_a_correction() -> None:
    by_column = json_schema("campaign")["properties"]["sensors"]["anyOf"][1]
    assert {"gain", "delay", "clock_rate", "swap_with", "runs"} <= set(by_column["additionalProperties"]["properties"])
