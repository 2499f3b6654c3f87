"""The loop on campaigns of vehicles simulated by Exudyn."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("exudyn")

from tests.third_program.campaign import CASES
from tests.third_program.loops import loop, size_of

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]  # simulation and loop: one to several minutes each


@pytest.mark.parametrize("name", CASES)
def test_the_loop_names_the_effect_its_location_and_its_size(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    report = loop(case, tmp_path / name)
    assert report["verdict"] == "effect"
    (effect,) = report["effects"]
    assert (effect["kind"], effect["at"], effect["wheelset"]) == (case.effect["kind"], case.effect["at"], None)
    size = size_of(case)
    assert effect["parameters"][size]["value"] == pytest.approx(case.effect[size], rel=0.1)
    assert report["unexplained"] < 1.5
