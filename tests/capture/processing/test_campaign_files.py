"""End to end: the demo logger's axle boxes have play that nobody declared, and the loop names it from the wire."""

from __future__ import annotations

import subprocess
from pathlib import Path

import railui
from railui.documents.check import check
from tests.capture.ports import RAILUI, demo_logger, recorder, told, truth_of, until
from tests.capture.recorder.test_record import ended, rows
from tests.capture.rides import HOME

MAP = HOME / "designs/maps/demo_logger.yaml"


def record(home: Path, name: str, seed: int, speed: str) -> Path:
    """A ride through a pseudo-terminal, ten times as fast as it was."""
    out = home / name
    words = ("--seed", str(seed), "--speed", speed, "--seconds", "28", "--pace", "12", "--once")
    with demo_logger(home / f"port_{name}", *words) as logger:
        child = recorder(home / f"port_{name}", out)
        sent = truth_of(logger)
        until(lambda: rows(out) >= sent["samples"])
    ended(child)
    assert told(out)["lost"] == 0
    return out


def test_what_came_through_the_wire_names_the_effect_that_nobody_declared(tmp_path: Path) -> None:
    monday, tuesday = record(tmp_path, "monday", 1, "40"), record(tmp_path, "tuesday", 2, "31")
    words = ["--map", str(MAP), "--adjust", str(monday), "--validate", str(tuesday), "-o", str(tmp_path / "campaign")]
    subprocess.run([*RAILUI, "capture", "campaign", *words, "-q"], check=True, capture_output=True)
    assert check([tmp_path / "campaign"]) == []
    found = railui.loop(str(tmp_path / "campaign"))
    assert found["verdict"] == "effect"
    effect = found["effects"][0]
    assert (effect["kind"], effect["at"]) == ("free_play", "primary_lateral")
    assert abs(effect["parameters"]["half_width"]["value"] - 0.45e-3) < 0.05e-3
    assert found["after"]["nrmse"] < 0.4 * found["before"]["nrmse"]
