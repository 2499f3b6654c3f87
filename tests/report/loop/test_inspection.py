"""Advice of the report: every effect, discrepancy and verdict has something to inspect."""

from __future__ import annotations

from typing import Any

import pytest

from railui import core
from railui.report.loop.inspection import NONE, UNLOCATED, inspection_lines

KINDS = [record["kind"] for record in core.effect_catalogue() if record["kind"] != "measured_force"]


def report(**keys: Any) -> dict[str, Any]:
    return {"effects": [], "outside": None, "verdict": "effect", "unexplained": 1.0} | keys


@pytest.mark.parametrize("kind", KINDS)
def test_every_effect_of_the_catalogue_has_advice(kind: str) -> None:
    record = core.effect_record(kind)
    (line,) = inspection_lines(report(effects=[{"kind": kind, "at": record["at"][0], "wheelset": None}]))
    assert len(line) > 15 and "{" not in line


def test_a_clearance_names_its_joint() -> None:
    effect = {"kind": "free_play", "at": "primary_lateral", "wheelset": 2}
    (line,) = inspection_lines(report(effects=[effect]))
    assert line == "clearance in the lateral primary suspension of wheelset 2: guides, bushes, wear plates, pins"


def test_without_an_effect_nothing_on_the_vehicle_is_named() -> None:
    assert inspection_lines(report(verdict="none")) == [NONE]
    for source, known in (("stated", "stated"), ("estimated", "estimated from the runs")):
        (line,) = inspection_lines(report(verdict="none", unexplained=2.1, floor={"source": source}))
        assert line.startswith(f"sensors and cables: noise is larger than {known}; ")


def test_a_discrepancy_without_a_location_says_so() -> None:
    outside = {"at": None, "wheelset": None, "against": "z"}
    assert inspection_lines(report(verdict="outside", outside=outside)) == [UNLOCATED]
    assert inspection_lines(report(verdict="outside")) == [UNLOCATED]


def test_a_discrepancy_at_one_of_several_joints_names_all() -> None:
    locations = [{"at": at, "wheelset": None} for at in ("primary_yaw", "wheelset", "contact")]
    outside = {"at": None, "wheelset": None, "against": "z", "locations": locations}
    (line,) = inspection_lines(report(verdict="outside", outside=outside))
    assert line.startswith("the primary suspension in yaw and the wheel-rail contact; ")


def test_a_discrepancy_at_a_joint_names_it() -> None:
    outside = {"at": "secondary_yaw", "wheelset": None, "against": "v"}
    (line,) = inspection_lines(report(verdict="outside", outside=outside))
    assert line.startswith("the secondary suspension in yaw; ")


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"against": "t"}, "vehicle.rig.damping during a run"),
        ({"against": "s"}, "vehicle.rig.damping along the track"),
        ({"against": "s", "runs": []}, "vehicle.rig.damping between the runs"),
    ],
)
def test_conditions_are_those_of_the_abscissa(keys: dict[str, Any], words: str) -> None:
    outside = {"at": "rig", "wheelset": None, "parameter": "vehicle.rig.damping"} | keys
    (line,) = inspection_lines(report(verdict="outside", outside=outside))
    assert words in line
