"""JSON Schema of multibody vehicles."""

from __future__ import annotations

from typing import Any

from railui.vehicle.design_schema import design_model, number_group
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


def bodies_schema(effects: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the schema of a multibody design and its definitions, given the schema of an effect."""
    made = design_model("vehicle").model_json_schema()
    definitions: dict[str, Any] = made.pop("$defs", {})
    made["properties"]["vehicle"] = {
        "type": "object",
        "title": "bodies and elements",
        "properties": {
            "bodies": _named(_numbers("body", BODY)),
            "elements": _named({"oneOf": [_element(kind) for kind in ELEMENT_KINDS]}),
            "floor": _named(_numbers("floor", POSITION)),
        },
        "required": ["elements"],
        "additionalProperties": False,
    }
    made["properties"]["contact"] = _contact()
    made["properties"]["load"] = LOADS
    made["properties"]["effects"]["items"] = _anywhere(effects)
    made["required"] = ["vehicle"]
    return made, definitions


def _named(one: dict[str, Any]) -> dict[str, Any]:
    return {"type": "object", "propertyNames": NAME, "additionalProperties": one}


def _numbers(kind: str, known: tuple[Any, ...]) -> dict[str, Any]:
    """Return the schema of the numbers and words of a kind of part."""
    made: dict[str, Any] = group_model(kind, known).model_json_schema()
    made["properties"] |= {key: {"type": "string"} for key in word_keys(kind)}
    made["title"] = kind.replace("_", " ")
    return made


def _element(kind: str) -> dict[str, Any]:
    made = _numbers(kind, parameters_of_kind(kind))
    words = made["properties"]
    words["kind"] = {"const": kind}
    if "between" in words:
        told = f"two bodies, or a body and {GROUND}"
        words["between"] = {
            "type": "array",
            "items": {"type": "string"},
            "minItems": 2,
            "maxItems": 2,
            "description": told,
        }
    if "side" in words:
        words["side"] = {"enum": list(SIDES)}
    if kind in DIRECTED_KINDS:
        words["direction"] = {"enum": list(DIRECTIONS)}
    made["required"] = ["kind", *made.get("required", []), *(["between"] if "between" in words else [])]
    return made


def _contact() -> dict[str, Any]:
    """Return the schema of the contact groups and of the numbers common to all wheelsets."""
    one: dict[str, Any] = number_group("contact_of_wheels", WHEELSET_CONTACT).model_json_schema()
    shared = [p.path.removeprefix("contact.") for p in CONTACT if p.path.count(".") == 1]
    value = {"type": ["number", "string"]}
    properties: dict[str, Any] = dict.fromkeys(shared, value) | {"gauge_widens_clearance": {"type": "boolean"}}
    return {"type": "object", "properties": properties, "additionalProperties": one}


def _anywhere(effects: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of an effect at any element of the vehicle."""
    found = []
    for one in effects["oneOf"]:
        properties = one["properties"] | {"at": {"type": "string"}, "wheelset": {"type": ["integer", "null"]}}
        found.append({**one, "properties": properties, "required": ["kind"]})
    return {"oneOf": found}
