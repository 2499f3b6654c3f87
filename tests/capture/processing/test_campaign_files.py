"""End to end: clearance in the demo vehicle's axle boxes, not in the nominal model, is identified from a recording."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

import railui
from railui.campaign.campaign import load_campaign
from railui.capture.processing.campaign_files import CampaignRun, write_campaign
from railui.capture.processing.measured_run import MeasuredRun
from railui.documents.check import check
from tests.capture.ports import RAILUI, capture_report, counts_sent_by, running_logger, start_recorder, wait_until
from tests.capture.recorder.test_record import interrupt, row_count
from tests.capture.simulated_runs import HOME

MAP = HOME / "designs/maps/demo_logger.yaml"


def record(home: Path, name: str, seed: int, speed: str) -> Path:
    """Record a run through a pseudo-terminal, twelve times as fast as real time."""
    out = home / name
    words = ("--seed", str(seed), "--speed", speed, "--seconds", "28", "--pace", "12", "--once")
    with running_logger(home / f"port_{name}", *words) as logger:
        child = start_recorder(home / f"port_{name}", out)
        sent = counts_sent_by(logger)
        wait_until(lambda: row_count(out) >= sent["samples"])
    interrupt(child)
    assert capture_report(out)["lost"] == 0
    return out


def test_unmodelled_clearance_is_identified_from_a_recording(tmp_path: Path) -> None:
    monday, tuesday = record(tmp_path, "monday", 1, "40"), record(tmp_path, "tuesday", 2, "31")
    words = ["--map", str(MAP), "--adjust", str(monday), "--validate", str(tuesday), "-o", str(tmp_path / "campaign")]
    subprocess.run([*RAILUI, "capture", "campaign", *words, "-q"], check=True, capture_output=True)
    assert check([tmp_path / "campaign"]) == []
    assert load_campaign(tmp_path / "campaign/campaign.yaml").origin == "simulated"  # by the simulated logger
    result = railui.loop(str(tmp_path / "campaign"))
    assert result["verdict"] == "effect"
    effect = result["effects"][0]
    assert (effect["kind"], effect["at"]) == ("free_play", "primary_lateral")
    assert abs(effect["parameters"]["half_width"]["value"] - 0.45e-3) < 0.05e-3
    assert result["after"]["nrmse"] < 0.4 * result["before"]["nrmse"]


@pytest.mark.parametrize("is_simulated", [False, True])
def test_a_campaign_states_whether_its_runs_were_measured(tmp_path: Path, is_simulated: bool) -> None:
    t = np.arange(400) / 200.0
    columns = {"t": t, "v": np.full(t.size, 40.0), "s": 40.0 * t, "yw": 1e-3 * np.sin(t), "ay1": np.cos(t)}
    units = {"t": "s", "v": "m/s", "s": "m", "yw": "m", "ay1": "m/s^2"}
    run = MeasuredRun(columns, units, {}, None, {}, None, {}, ())
    runs = [CampaignRun(role, "logger", run, is_simulated) for role in ("adjust", "validate")]
    path = write_campaign(tmp_path / "campaign", "test", HOME / "designs/test_bogie.yaml", runs)
    assert load_campaign(path).origin == ("simulated" if is_simulated else "measured")
