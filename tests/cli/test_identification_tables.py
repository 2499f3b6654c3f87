"""Tables of the identified effects: the wheelset or bogie is named where a location has several."""

from __future__ import annotations

from typing import Any

import pytest

import railui
from railui.cli.identification_tables import effects_table
from tests.cli.runner import ROOT

VALUE = {"value": 1.0, "sd": 0.1, "unit": "N"}


def effect(at: str, wheelset: int | None = None) -> dict[str, Any]:
    return {"kind": "dry_friction", "at": at, "wheelset": wheelset, "parameters": {"force": VALUE}, "phases": []}


def wheelsets(*effects: dict[str, Any], design: str = "check_bogie.yaml") -> list[str] | None:
    """Return the column of wheelsets; None where the table has none."""
    structure = railui.Design.load(ROOT / "designs" / design).structure
    columns = {column.header: list(column.cells) for column in effects_table({"effects": effects}, structure).columns}
    return columns.get("wheelset")


@pytest.mark.parametrize("at", ["secondary_lateral", "secondary_yaw", "rig", "frame", "ay1"])
def test_a_location_without_wheelset_has_no_column_of_wheelsets(at: str) -> None:
    assert wheelsets(effect(at)) is None


@pytest.mark.parametrize("at", ["primary_lateral", "contact", "track", "wheelset"])
def test_an_effect_at_both_wheelsets_says_so(at: str) -> None:
    assert wheelsets(effect(at), effect(at, 2), effect("secondary_yaw")) == ["both", "2", ""]


def test_of_a_coach_wheelsets_and_bogies_are_distinguished() -> None:
    found = [effect("primary_lateral"), effect("primary_lateral", 3), effect("secondary_lateral")]
    found += [effect("secondary_lateral", 2)]
    assert wheelsets(*found, design="manchester_coach.yaml") == ["all", "3", "both bogies", "bogie 2"]


def test_an_estimate_on_its_bound_is_marked() -> None:
    found = effect("rig") | {"parameters": {"force": VALUE | {"is_on_bound": True}, "slip_speed": VALUE}}
    columns = {column.header: list(column.cells) for column in effects_table({"effects": [found]}).columns}
    assert columns["parameter"] == ["force (at its bound)", "slip_speed"]
