"""End to end: clearance in the demo vehicle's axle boxes, not in the nominal model, is identified from a recording."""

from __future__ import annotations

import subprocess
from pathlib import Path

import railui
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
    result = railui.loop(str(tmp_path / "campaign"))
    assert result["verdict"] == "effect"
    effect = result["effects"][0]
    assert (effect["kind"], effect["at"]) == ("free_play", "primary_lateral")
    assert abs(effect["parameters"]["half_width"]["value"] - 0.45e-3) < 0.05e-3
    assert result["after"]["nrmse"] < 0.4 * result["before"]["nrmse"]
