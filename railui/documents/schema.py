"""JSON Schema of YAML files, for editors, from the models that validate them."""

from __future__ import annotations

from typing import Any

from railui.campaign.schema import CampaignModel
from railui.documents.schema_bodies import LOADS, bodies_schema
from railui.io.schema_line import schema_name
from railui.optimisation.study_schema import StudyModel
from railui.vehicle.contact_profiles import ProfilesModel
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

KINDS = ("design", "campaign", "study")


def json_schema(kind: str, catalogue: Catalogue | None = None) -> dict[str, Any]:
    """Return the JSON Schema of a design, a campaign or a study; ValueError for another kind.

    >>> json_schema("study")["$id"]
    'railui.study/1'
    """
    known = kernel_catalogue() if catalogue is None and kind != "study" else catalogue or ()
    if kind == "design":
        made = _design(known)
    elif kind == "campaign":
        made = CampaignModel.model_json_schema()
        made["properties"]["sensors"]["items"] = _effects(known, sensors=True)
    elif kind == "study":
        made = StudyModel.model_json_schema()
    else:
        raise ValueError(f"no schema of {kind!r}; known are {', '.join(KINDS)}")
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": schema_name(kind),
        **_without_samples(made),
        "title": kind,
    }


def _design(catalogue: Catalogue) -> dict[str, Any]:
    forms = {form: design_model(form).model_json_schema() for form in ("bogie", "rig")}
    definitions: dict[str, Any] = {}
    for made in forms.values():
        definitions |= made.pop("$defs")
        made["properties"]["effects"]["items"] = _effects(catalogue, sensors=False)
    forms["bogie"]["properties"]["load"] = LOADS
    bodies, more = bodies_schema(_effects(catalogue, sensors=False))
    definitions["bogie_design_contact"] = _measured(definitions["bogie_design_contact"], definitions)
    bodies["properties"]["contact"] = _measured(bodies["properties"]["contact"], {})
    return {"anyOf": [*forms.values(), bodies], "$defs": definitions | more}


def _measured(contact: dict[str, Any], definitions: dict[str, Any]) -> dict[str, Any]:
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
        "properties": properties | {"profiles": ProfilesModel.model_json_schema()},
        "additionalProperties": each,
        "if": {"not": {"required": ["profiles"]}},
        "then": needed,
    }


def _effects(catalogue: Catalogue, *, sensors: bool) -> dict[str, Any]:
    entries = [_effect(record) for record in catalogue if is_sensor(record) == sensors]
    return {"oneOf": entries} if entries else {"type": "object"}


def _effect(record: Record) -> dict[str, Any]:
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
        told = f"{p['symbol']} [{p['unit']}]; {p.get('origin', '')}"
        properties[str(p["key"])] = {**value, "description": told}
    required = ["kind"] if len(places) == 1 else ["kind", "at"]
    return {
        "type": "object",
        "title": record["title"],
        "description": record["source"],
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }


def _without_samples(value: Any) -> Any:
    """Remove the key `sample`, which serves remedies only and is not JSON Schema."""
    if isinstance(value, dict):
        return {k: _without_samples(v) for k, v in value.items() if not (k == "sample" and isinstance(v, str))}
    return [_without_samples(v) for v in value] if isinstance(value, list) else value
