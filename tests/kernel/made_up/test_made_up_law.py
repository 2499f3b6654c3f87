"""A law that is in one file outside of the package goes through score test, refit and report."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.truth import campaign
from tests.truth.effects import KINDS, SUSPENSIONS, force, parse
from tests.truth.laws import Array, Parameters

ROOT = Path(__file__).parents[3]
LAW = Path(__file__).with_name("widening_damper.rs")
KIND, PLACE, DAMPING = "widening_damper", "secondary_lateral", 2.0e7


def widening_damper(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, None]:
    return -p["damping"] * np.abs(z) * v, None


def build(folder: Path) -> None:
    """The package with a kernel that has the law, compiled quickly rather than to be quick."""
    target = ROOT / "target" / "made_up"
    command = ["cargo", "build", "--locked", "--release", "-p", "railui_python", "--config"]
    command += ["profile.release.opt-level=1", "--target-dir", str(target)]
    python = {"PYO3_PYTHON": sys.executable, "RAILUI_EFFECT": str(LAW)}
    subprocess.run(command, cwd=ROOT, env={**os.environ, **python}, check=True)
    shutil.copytree(ROOT / "railui", folder / "railui", ignore=shutil.ignore_patterns("_core*.so", "__pycache__"))
    shutil.copy(target / "release" / "librailui_python.so", folder / "railui" / "_core.abi3.so")


def railui(folder: Path, *words: str) -> str:
    """Text of a command of the package in a folder."""
    command = [sys.executable, "-m", "railui", *words]
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 4), done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_a_law_in_a_file_of_its_own_is_listed_detected_fitted_and_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(KINDS, KIND, force(widening_damper, "damping", at=SUSPENSIONS))
    build(tmp_path)
    assert KIND in railui(tmp_path, "effects")
    order = campaign.Order([parse(f"{KIND} at={PLACE} damping={DAMPING}")], seed=5, name="made up")
    campaign.write(campaign.campaign(order), tmp_path / "made_up")
    text = railui(tmp_path, "loop", "made_up", "-o", "out")
    document: dict[str, Any] = json.loads((tmp_path / "out" / "loop.json").read_text())
    assert document["verdict"] == "effect"
    [found] = document["effects"]
    assert (found["kind"], found["at"]) == (KIND, PLACE)
    estimated = found["parameters"]["damping"]["value"]
    assert abs(estimated / DAMPING - 1.0) < 0.1
    # scored and refitted, before every kind that is built in
    best = document["ranking"][0]
    assert (best["kind"], best["refitted"]) == (KIND, True)
    assert "damper that grows with the deflection" in text
    assert "the made-up damper of" in (tmp_path / "out" / "report.html").read_text("utf-8")
