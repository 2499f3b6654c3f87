"""JSON Schema of YAML files, for editors, from the models that validate them."""

from __future__ import annotations

from typing import Any

from railui.campaign.schema import CampaignModel
from railui.documents.schema_multibody import LOADS, multibody_schema
from railui.io.schema_line import schema_name
from railui.optimisation.study_schema import StudyModel
from railui.planning.plan_file import PlanModel
from railui.track.line_file import LineModel
from railui.vehicle.design_schema import design_model
from railui.vehicle.effect_reader import ABSCISSAE
from railui.vehicle.effects import (
    WHEELSET_LOCATIONS,
    Catalogue,
    Record,
    has_abscissa,
    is_curve,
    is_sensor,
    kernel_catalogue,
)
from railui.vehicle.element import ElementModel
from railui.vehicle.profiles_schema import profiles_schema

# an element of a file at a location of a design
MOUNTED_ELEMENT: dict[str, Any] = {
    "type": "object",
    "properties": {
        "element": {
            "type": ["string", "object"],
            "description": "file of an element or of a force table (CSV), relative to the design, or its keys",
        },
        "at": {"type": "string"},
        "wheelset": {"type": "integer"},
        "count": {"type": "number", "exclusiveMinimum": 0, "description": "elements in parallel"},
    },
    "required": ["element", "at"],
    "additionalProperties": False,
}
KINDS = ("design", "campaign", "study", "plan", "element", "line")


def json_schema(kind: str, catalogue: Catalogue | None = None) -> dict[str, Any]:
    """Return the JSON Schema of a design, campaign, study, plan, element or line; ValueError for another kind.

    >>> json_schema("study")["$id"]
    'railui.study/1'
    """
    records = kernel_catalogue() if catalogue is None and kind not in ("study", "plan", "line") else catalogue or ()
    if kind == "design":
        schema = _design_schema(records)
    elif kind == "campaign":
        schema = CampaignModel.model_json_schema()
        of_sensors, by_column = schema["properties"]["sensors"]["anyOf"]
        of_sensors["items"] = by_column["properties"]["effects"]["items"] = _effects_schema(records, sensors=True)
    elif kind == "study":
        schema = StudyModel.model_json_schema()
    elif kind == "plan":
        schema = PlanModel.model_json_schema()
    elif kind == "line":
        schema = LineModel.model_json_schema()
    elif kind == "element":
        schema = ElementModel.model_json_schema()
        schema["properties"]["effects"]["items"] = _element_laws_schema(records)
    else:
        raise ValueError(f"no schema of {kind!r}; known are {', '.join(KINDS)}")
    return schema_document(kind, schema)


def schema_document(kind: str, schema: dict[str, Any]) -> dict[str, Any]:
    """Return the JSON Schema of a kind of file from that of its model."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": schema_name(kind),
        **_remove_samples(schema),
        "title": kind,
    }


def _design_schema(catalogue: Catalogue) -> dict[str, Any]:
    forms = {form: design_model(form).model_json_schema() for form in ("bogie", "rig")}
    definitions: dict[str, Any] = {}
    for schema in forms.values():
        definitions |= schema.pop("$defs")
        schema["properties"]["effects"]["items"] = _design_effects_schema(catalogue)
    forms["bogie"]["properties"]["load"] = LOADS
    multibody, multibody_definitions = multibody_schema(_design_effects_schema(catalogue))
    definitions["bogie_design_contact"] = _contact_schema(definitions["bogie_design_contact"], definitions)
    multibody["properties"]["contact"] = _contact_schema(multibody["properties"]["contact"], {})
    return {"anyOf": [*forms.values(), multibody], "$defs": definitions | multibody_definitions}


def _contact_schema(contact: dict[str, Any], definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a contact that requires all numbers unless profiles provide them."""
    properties, each = contact["properties"], contact.get("additionalProperties")
    needed: dict[str, Any] = {"required": contact.get("required", []), "properties": {}}
    for key, value in properties.items():
        group = definitions.get(str(value.get("$ref", "")).rpartition("/")[2], {})
        needed["properties"][key] = {"required": group.pop("required", [])} if "properties" in group else {}
    if isinstance(each, dict):
        needed["additionalProperties"] = {"required": each["required"]}
        each = {k: v for k, v in each.items() if k != "required"}
    return {
        **{k: v for k, v in contact.items() if k != "required"},
        "properties": properties | {"profiles": profiles_schema(None if each else ("leading", "trailing"))},
        "additionalProperties": each,
        "if": {"not": {"required": ["profiles"]}},
        "then": needed,
    }


def _design_effects_schema(catalogue: Catalogue) -> dict[str, Any]:
    """Return the schema of a design's effects: one of the catalogue, or an element of a file."""
    schema = _effects_schema(catalogue, sensors=False)
    return {"oneOf": [*schema["oneOf"], MOUNTED_ELEMENT]} if "oneOf" in schema else schema


def _element_laws_schema(catalogue: Catalogue) -> dict[str, Any]:
    """Return the schema of an element's laws: those of a suspension, without a location."""
    laws = [_effect_schema(record) for record in catalogue if "rig" in record["at"]]
    for law in laws:
        law["properties"] = {k: v for k, v in law["properties"].items() if k not in ("at", "wheelset")}
        law["required"] = [key for key in law.get("required", []) if key != "at"]
    return {"oneOf": laws}


def _effects_schema(catalogue: Catalogue, *, sensors: bool) -> dict[str, Any]:
    entries = [_effect_schema(record) for record in catalogue if is_sensor(record) == sensors]
    return {"oneOf": entries} if entries else {"type": "object"}


def _effect_schema(record: Record) -> dict[str, Any]:
    places = list(record["at"])
    value: dict[str, Any] = {"type": ["number", "string"]}
    properties: dict[str, Any] = {"kind": {"const": record["kind"]}, "at": {"enum": places}}
    if any(at in WHEELSET_LOCATIONS for at in places):
        properties["wheelset"] = {"enum": [1, 2, None], "description": "1 leads, 2 trails, both where absent"}
    if is_curve(record):
        value = {"type": "array", "items": value}
    if has_abscissa(record):
        properties["against"] = {"enum": list(ABSCISSAE), "default": "z"}
    for p in record["parameters"]:
        description = f"{p['symbol']} [{p['unit']}]; {p.get('origin', '')}"
        properties[str(p["key"])] = {**value, "description": description}
    required = ["kind"] if len(places) == 1 else ["kind", "at"]
    return {
        "type": "object",
        "title": record["title"],
        "description": record["source"],
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }


def _remove_samples(value: Any) -> Any:
    """Remove the key `sample`, which serves remedies only and is not JSON Schema."""
    if isinstance(value, dict):
        return {k: _remove_samples(v) for k, v in value.items() if not (k == "sample" and isinstance(v, str))}
    return [_remove_samples(v) for v in value] if isinstance(value, list) else value
