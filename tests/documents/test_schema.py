"""JSON Schemas accept the designs of the package and reject what the readers reject."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator

from railui.documents.schema import KINDS, json_schema

HOME = Path(__file__).parents[2]
FILES = {
    "design": [*HOME.glob("designs/*.yaml"), HOME / "designs/campaigns/worn_axle_box/vehicle.yaml"],
    "study": [*HOME.glob("designs/studies/*.yaml")],
    "plan": [*HOME.glob("designs/plans/*.yaml")],
    "element": [*HOME.glob("designs/elements/*.yaml")],
    "line": [*HOME.glob("designs/lines/*.yaml")],
    "campaign": [*HOME.glob("designs/campaigns/*/campaign.yaml")],
}


def faults(kind: str, data: Any) -> list[str]:
    return [error.message for error in Draft202012Validator(json_schema(kind)).iter_errors(data)]


@pytest.mark.parametrize("kind", KINDS)
def test_designs_campaigns_and_studies_fit_their_schema(kind: str) -> None:
    Draft202012Validator.check_schema(json_schema(kind))
    assert FILES[kind]
    for file in FILES[kind]:
        assert faults(kind, yaml.safe_load(file.read_text("utf-8"))) == [], file.name


@pytest.mark.parametrize(
    ("file", "path", "value"),
    [
        ("check_bogie", ("vehicle", "frame", "mas"), 3),
        ("check_bogie", ("vehicle", "primary", "lateral_stiffness"), [1]),
        ("cooperrider", ("vehicle", "bodies", "frame", "mas"), 3),
        ("cooperrider", ("vehicle", "elements", "primary", "kind"), "sprnig"),
        ("cooperrider", ("contact", "wheels", "conicty"), 0.1),
    ],
)
def test_the_schema_rejects_what_a_reader_rejects(file: str, path: tuple[str, ...], value: Any) -> None:
    data = yaml.safe_load((HOME / f"designs/{file}.yaml").read_text("utf-8"))
    group = data
    for key in path[:-1]:
        group = group[key]
    group[path[-1]] = value
    assert faults("design", data)
