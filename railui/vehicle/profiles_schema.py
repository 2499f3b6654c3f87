"""Pydantic models of `contact.profiles`, for validation and for the JSON Schema."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any

from pydantic import Field, create_model

from railui.io.fields import Group, Switch, ValueReader, choice_reader
from railui.io.units import UnitError
from railui.vehicle.contact_profiles import GROUP_KEYS, PARAMETERS_BY_KEY, USES
from railui.vehicle.design_schema import number_field

SIDES = ("left", "right")
FILE = {"type": "string", "description": "file, from the design's directory"}
SIDES_SCHEMA: dict[str, Any] = {
    "anyOf": [
        FILE,
        {
            "type": "object",
            "properties": dict.fromkeys(SIDES, FILE),
            "required": list(SIDES),
            "additionalProperties": False,
        },
    ],
    "description": "a file, or {left: FILE, right: FILE}; y points outward on both sides",
}


def read_sides(value: Any) -> tuple[str, str]:
    """Return the files of the right-hand and of the left-hand side."""
    if isinstance(value, dict) and set(value) == set(SIDES):
        return _read_file(value["right"]), _read_file(value["left"])
    if isinstance(value, dict):
        raise UnitError("is not a file for each side", "write {left: FILE, right: FILE}")
    return (_read_file(value),) * 2


def _read_file(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise UnitError("is not the name of a file", "write a file, or {left: FILE, right: FILE}")
    return value


Sides = Annotated[Any, ValueReader(read_sides, SIDES_SCHEMA)]
NUMBERS: dict[str, Any] = {key: number_field(p) for key, p in PARAMETERS_BY_KEY.items()}
ProfilesModel = create_model(
    "ProfilesModel",
    __base__=Group,
    __doc__="`contact.profiles` of a design: the profiles, their position and their use.",
    wheel=(Sides, ...),
    rail=(Sides, ...),
    **NUMBERS,
    mirror_rail=(Switch, False),
    use=(Annotated[str, choice_reader(USES)], USES[0]),
)
OWN_NUMBERS: dict[str, Any] = {key: number_field(replace(PARAMETERS_BY_KEY[key], optional=True)) for key in GROUP_KEYS}
# of one contact group, where it differs from the other wheelsets
GroupProfilesModel = create_model(
    "GroupProfilesModel",
    __base__=Group,
    __doc__="Profiles of the wheelsets of one contact group.",
    wheel=(Sides, Field(default=None)),
    **OWN_NUMBERS,
)


def profiles_schema(groups: tuple[str, ...] | None) -> dict[str, Any]:
    """Return the JSON Schema of `contact.profiles` with these contact groups; of any name for None."""
    schema, of_group = ProfilesModel.model_json_schema(), GroupProfilesModel.model_json_schema()
    if groups is None:
        return schema | {"additionalProperties": of_group}
    return schema | {"properties": schema["properties"] | dict.fromkeys(groups, of_group)}
