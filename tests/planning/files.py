"""Plan files of the test bogie, written and read."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

from railui.planning.plan_file import PlanFile, load_plan
from railui.vehicle.design import Design
from railui.vehicle.design_reader import load_design
from tests.truth.campaign import DECLARED
from tests.truth.files import NOISE, design

TRACK_NOISE = {c: NOISE[c][1] for c in ("yw", "phiw", "gauge")}


def nominal_design() -> Design:
    """Return the nominal vehicle of the independent generator."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "vehicle.yaml"
        path.write_text(design(DECLARED))
        return load_design(path)


def plan_text(noise: Mapping[str, str], more: str = "") -> str:
    """Return a plan file with the noise of the track."""
    columns = {**TRACK_NOISE, **noise}
    return "noise: {" + ", ".join(f"{name}: {sd}" for name, sd in columns.items()) + "}\n" + more


def plan_file(noise: Mapping[str, str], more: str = "") -> PlanFile:
    """Return a plan file as read for the nominal vehicle."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plan.yaml"
        path.write_text(plan_text(noise, more))
        return load_plan(path, nominal_design())
