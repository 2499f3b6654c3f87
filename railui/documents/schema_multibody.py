"""JSON Schema of multibody vehicles."""

from __future__ import annotations

from typing import Any

from railui.vehicle.design_schema import design_model, number_group
from railui.vehicle.division import POSITION_KEYS
from railui.vehicle.element_kinds import (
    BODY,
    DIRECTED_KINDS,
    DIRECTIONS,
    ELEMENT_KINDS,
    GROUND,
    POSITION,
    parameters_of_kind,
)
from railui.vehicle.multibody_reader import SIDES, group_model, word_keys
from railui.vehicle.parameters import CONTACT, WHEELSET_CONTACT

# load states: changed values by path, and the active state
LOADS = {
    "type": "object",
    "title": "states of loading",
    "properties": {"state": {"type": "string"}},
    "additionalProperties": {"type": "object", "additionalProperties": {"type": ["number", "string"]}},
}
NAME = {"pattern": "^[A-Za-z_][A-Za-z0-9_]*$"}


def multibody_schema(effects: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the schema of a multibody design and its definitions, given the schema of an effect."""
    schema = design_model("vehicle").model_json_schema()
    definitions: dict[str, Any] = schema.pop("$defs", {})
    schema["properties"]["vehicle"] = {
        "type": "object",
        "title": "bodies and elements",
        "properties": {
            "bodies": _by_name(_part_schema("body", BODY)),
            "elements": _by_name({"oneOf": [_element_schema(kind) for kind in ELEMENT_KINDS]}),
            "floor": _by_name(_part_schema("floor", POSITION)),
        },
        "required": ["elements"],
        "additionalProperties": False,
    }
    schema["properties"]["contact"] = _contact_schema()
    schema["properties"]["load"] = LOADS
    schema["properties"]["effects"]["items"] = _effects_at_elements(effects)
    schema["required"] = ["vehicle"]
    return schema, definitions


def _by_name(entry: dict[str, Any]) -> dict[str, Any]:
    return {"type": "object", "propertyNames": NAME, "additionalProperties": entry}


def _part_schema(kind: str, known: tuple[Any, ...]) -> dict[str, Any]:
    """Return the schema of the numbers and words of a kind of part."""
    schema: dict[str, Any] = group_model(kind, known).model_json_schema()
    schema["properties"] |= {key: {"type": "string"} for key in word_keys(kind)}
    schema["title"] = kind.replace("_", " ")
    return schema


def _element_schema(kind: str) -> dict[str, Any]:
    schema = _part_schema(kind, parameters_of_kind(kind))
    words = schema["properties"]
    if kind != "wheelset":
        laws = [p.path for p in parameters_of_kind(kind) if p.path not in POSITION_KEYS]
        words |= {key: _or_list(words[key]) for key in laws}
    words["kind"] = {"const": kind}
    if "between" in words:
        description = f"two bodies, or a body and {GROUND}"
        words["between"] = {
            "type": "array",
            "items": {"type": "string"},
            "minItems": 2,
            "maxItems": 2,
            "description": description,
        }
    if "side" in words:
        words["side"] = {"enum": list(SIDES)}
    if kind in DIRECTED_KINDS:
        words["direction"] = {"enum": list(DIRECTIONS)}
    schema["required"] = ["kind", *schema.get("required", []), *(["between"] if "between" in words else [])]
    return schema


def _or_list(number: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a number that joints or wheelsets share, or of a list with one for each."""
    entry = {"type": ["number", "string"]}
    listed = {"type": "array", "items": entry, "minItems": 2, "description": "one for each joint or wheelset"}
    return {**number, "anyOf": [*number["anyOf"], listed]}


def _contact_schema() -> dict[str, Any]:
    """Return the schema of the contact groups and of the numbers common to all wheelsets."""
    group: dict[str, Any] = number_group("contact_of_wheels", WHEELSET_CONTACT).model_json_schema()
    group["properties"] = {key: _or_list(number) for key, number in group["properties"].items()}
    shared = [p.path.removeprefix("contact.") for p in CONTACT if p.path.count(".") == 1]
    value = {"type": ["number", "string"]}
    properties: dict[str, Any] = dict.fromkeys(shared, value) | {"gauge_widens_clearance": {"type": "boolean"}}
    return {"type": "object", "properties": properties, "additionalProperties": group}


def _effects_at_elements(effects: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of an effect at any element of the vehicle."""
    entries = []
    for entry in effects["oneOf"]:
        properties = entry["properties"] | {"at": {"type": "string"}, "wheelset": {"type": ["integer", "null"]}}
        entries.append({**entry, "properties": properties, "required": ["kind"]})
    return {"oneOf": entries}
