"""Terms of the loop report: models, verdicts, effects, locations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from railui import core
from railui.identification.result import LoopResult
from railui.identification.unmodelled.location_evidence import joint_of
from railui.vehicle.model import Model
from railui.vehicle.multibody import Structure

# keys of the report, and their names on the page, in figures and tables
MODEL_LABELS = {
    "measured": "measured",
    "declared": "nominal",
    "before": "calibrated",
    "after": "calibrated + effect",
    "floor": "noise floor",
}
MODELS = ("declared", "before", "after", "floor")
VERDICT_LABELS = {
    "none": "no unmodelled effect detected",
    "effect": "effect identified",
    "partial": "part of the discrepancy identified",
    "outside": "discrepancy outside the catalogue",
    "data": "data fault",
}
ROLE_LABELS = {"adjust": "estimation", "validate": "validation", "test": "test"}
# titles of the kernel's catalogue that a report states in other terms
LOCATIONS = {
    "primary_lateral": "lateral primary suspension",
    "primary_yaw": "primary suspension in yaw",
    "secondary_lateral": "lateral secondary suspension",
    "secondary_yaw": "secondary suspension in yaw",
    "contact": "wheel-rail contact",
    "track": "track",
    "wheelset_yaw": "yaw of the wheelset",
    "frame": "bogie frame",
    "frame_yaw": "yaw of the bogie frame",
    "rig": "rig",
}
PER_WHEELSET = ("primary_lateral", "primary_yaw", "contact", "track", "wheelset_yaw")


def shown_models(report: Mapping[str, Any]) -> dict[str, str]:
    """Return the models of a report with their names; without an effect the calibrated model is the final one."""
    if report["after"] == {key: report["before"].get(key) for key in report["after"]}:
        return {"declared": "nominal", "after": "calibrated", "floor": "noise floor"}
    return {model: MODEL_LABELS[model] for model in MODELS}


def common_rows(rows: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return the rows of the common effects, for a table with little room: by kind, in the order of `common_kinds`."""
    rows = list(rows)
    return [row for kind in core.common_kinds() for row in rows if row["kind"] == kind]


def effect_title(kind: str) -> str:
    """Return the name of a kind of effect; of `none`, the model without an effect."""
    if kind == "none":
        return "no effect added"
    return str(core.effect_record(kind)["title"])


def parameter_name(model: Model, path: str) -> str:
    """Return a parameter in words where it is that of an effect, as `slip speed of dry friction`."""
    group, _, rest = path.partition(".")
    if group not in ("effects", "sensors"):
        return path
    number, _, key = rest.partition(".")
    effects = model.design.effects if group == "effects" else model.sensors
    return f"{key.replace('_', ' ')} of {effect_title(effects[int(number)].kind)}"


def location_text(at: str, wheelset: int | None = None, structure: Structure | None = None) -> str:
    """Return a location for a table or a heading; structure: that of a vehicle of bodies.

    >>> location_text("primary_lateral", 2), location_text("wheelset", 1), location_text("ay1")
    ('lateral primary suspension, wheelset 2', 'wheelset 1', 'ay1')
    """
    if at == "wheelset" and wheelset:
        return f"wheelset {wheelset}"
    if structure is not None and at in structure.effect_locations:
        return _words(at) + (f", {_noun(structure, at)} {wheelset}" if wheelset else "")
    return LOCATIONS.get(at, at.replace("_", " ")) + (f", wheelset {wheelset}" if wheelset else "")


def joint_phrases(locations: Iterable[str], structure: Structure | None = None) -> list[str]:
    """Return the joints of some locations for a sentence, each once: forces on a wheelset act at its contact.

    >>> joint_phrases(["primary_yaw", "wheelset", "contact"])
    ['the primary suspension in yaw', 'the wheel-rail contact']
    """
    joints = dict.fromkeys(joint_of(at) for at in locations)
    return [f"the {location_text(at, structure=structure)}" for at in joints]


def location_phrase(at: str, wheelset: int | None = None, structure: Structure | None = None) -> str:
    """Return a location for a sentence; structure: that of a vehicle of bodies.

    >>> location_phrase("primary_lateral"), location_phrase("contact", 1), location_phrase("secondary_yaw")
    ('the lateral primary suspension of both wheelsets', 'the wheel-rail contact of wheelset 1', \
'the secondary suspension in yaw')
    >>> location_phrase("wheelset"), location_phrase("ay1")
    ('both wheelsets', 'signal ay1')
    """
    if structure is not None and at in structure.effect_locations:
        return _phrase_of_vehicle(structure, at, wheelset)
    which = f"wheelset {wheelset}" if wheelset else "both wheelsets"
    if at == "wheelset":
        return which
    if at == "wheelset_yaw":
        return f"the yaw motion of {which}"
    if at not in LOCATIONS:
        return f"signal {at}"
    return f"the {LOCATIONS[at]}" + (f" of {which}" if wheelset or at in PER_WHEELSET else "")


def joint_text(at: str, number: int | None = None, structure: Structure | None = None) -> str:
    """Return for a table which of the wheelsets or bogies a location refers to, empty where it is a single one.

    >>> joint_text("primary_lateral"), joint_text("contact", 2), joint_text("secondary_lateral"), joint_text("rig")
    ('both', '2', '', '')
    """
    if structure is None or at not in structure.effect_locations:
        return str(number or ("both" if at in (*PER_WHEELSET, "wheelset") else ""))
    noun, count = _noun(structure, at), len(structure.effect_locations[at].numbers)
    if noun == "wheelset":
        return str(number or _every(count)) if count > 1 else str(number or "")
    return _which(noun, count, number) if count > 1 else ""


def _words(at: str) -> str:
    """Location in words: `yaw_damper_yaw` is the yaw damper in yaw."""
    element, _, way = at.rpartition("_")
    if at in LOCATIONS or way not in ("lateral", "yaw", "roll"):
        return LOCATIONS.get(at, at.replace("_", " "))
    called = element.replace("_", " ")
    called = {"primary": "primary suspension", "secondary": "secondary suspension"}.get(called, called)
    return f"lateral {called}" if way == "lateral" and "lateral" not in called else f"{called} in {way}"


def _noun(structure: Structure, at: str) -> str:
    """Word for one of the joints or bodies of a location: a wheelset, or a bogie."""
    at_wheelsets = structure.effect_locations[at].catalogue_name.partition("_")[0] not in ("secondary", "frame")
    return "wheelset" if at_wheelsets else "bogie"


def _phrase_of_vehicle(structure: Structure, at: str, number: int | None) -> str:
    noun, count = _noun(structure, at), len(structure.effect_locations[at].numbers)
    which = _which(noun, count, number)
    if at == "wheelset":
        return which
    if at == "wheelset_yaw":
        return f"the yaw motion of {which}"
    return f"the {_words(at)}" + (f" of {which}" if number or count > 1 else "")


def _which(noun: str, count: int, number: int | None) -> str:
    return f"{noun} {number}" if number else f"{_every(count)} {noun}s"


def _every(count: int) -> str:
    return "both" if count == 2 else "all"


def unit_location(result: LoopResult, at: str) -> str:
    """Return a location with the SI units of an effect: a rig has none, except for a component measured in m and N.

    Its units are those of a suspension with the same kind of motion.
    """
    if at != "rig" or result.nominal.design.form != "bench":
        return at
    units = result.dataset.runs[0].units
    known = {("m", "N"): "primary_lateral", ("rad", "N*m"): "primary_yaw"}
    return known.get((units.get("z", ""), units.get("F", "")), at)
