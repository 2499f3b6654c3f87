"""The loop on campaigns of vehicles simulated by Exudyn."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("exudyn")

from railui.cli import cli
from tests.third_program.campaign import CASES, Case, write

pytestmark = pytest.mark.slow  # simulation and loop: one to two minutes each


def loop(case: Case, folder: Path) -> dict[str, Any]:
    write(case, folder)
    with pytest.raises(SystemExit) as done:
        cli(["loop", str(folder), "-o", str(folder / "out"), "--quiet"])
    assert done.value.code == 0
    return json.loads((folder / "out/loop.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", CASES)
def test_the_loop_names_the_effect_its_joint_and_its_size(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    report = loop(case, tmp_path / name)
    assert report["verdict"] == "effect"
    (effect,) = report["effects"]
    assert (effect["kind"], effect["at"], effect["wheelset"]) == (case.effect["kind"], case.effect["at"], None)
    size = "gap" if case.vehicle == "rig" else next(key for key in ("force", "half_width") if key in case.effect)
    assert effect["parameters"][size]["value"] == pytest.approx(case.effect[size], rel=0.1)
    assert report["unexplained"] < 1.5
