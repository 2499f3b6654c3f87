"""The page of the file formats: every key with unit, range and default, from the models that check the files."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from words import code, letters, plain, table

from railui.capture.processing.map_schema import QUANTITIES, MapModel
from railui.documents.schema import json_schema
from railui.io.number_format import format_quantity
from railui.optimisation.response_keys import RESPONSE_KEYS
from railui.runs.columns import COLUMNS, COMPARED_CHANNELS, RIG_COLUMNS
from railui.track.spectra import SPECTRA
from railui.vehicle.contact_profiles import ProfilesModel
from railui.vehicle.element_kinds import BODY, ELEMENT_KINDS, POSITION, parameters_of_kind
from railui.vehicle.multibody_reader import word_keys
from railui.vehicle.parameters import MAX_PLAUSIBLE, DEFAULTS_BY_USE, CONTACT, DEFAULT_ESTIMATED, RIDING, RIG, SETTINGS, VEHICLE, Parameter

NUMBERS = ("key", "letter", "unit", "default", "allowed", "usual", "meaning")
KEYS = ("key", "kind", "default", "meaning")
INTRODUCTION = """# Files

YAML 1.2: `1e6` is a number, `on` a word, a key that stands twice an error. A quantity is a number in SI or a text with a unit
(`30 kN*s/m`); a unit of another dimension is an error. An unknown key names the nearest known one, and all faults are told at
once as file:line:column. Files that railui writes begin with `schema: railui.KIND/1`; readers accept its absence and refuse a
newer number. Written files appear whole or not at all. `railui schema design` prints what an editor needs to check and complete.

A parameter's name is its path from the root, the same in files, overrides, studies and reports:
`vehicle.primary.lateral_stiffness`, `effects.0.half_width`. Where `adjust` or an override takes a group, its path means all
parameters below it.
"""


def page() -> str:
    """All formats."""
    return "".join([INTRODUCTION, *_design(), *_runs(), *_campaign(), *_track(), *_study(), *_map(), *_results()])


def _numbers(parameters: tuple[Parameter, ...]) -> str:
    return table(NUMBERS, [_number(p) for p in parameters])


def _number(p: Parameter) -> tuple[str, ...]:
    low, high = p.minimum, p.maximum if p.maximum < MAX_PLAUSIBLE else math.inf
    allowed = f"{'above' if p.exclusive_minimum else 'from'} {_told(low, p.unit)}" if math.isfinite(low) else ""
    allowed += f" to {_told(high, p.unit)}" if math.isfinite(high) else ""
    first, last = p.usual_range
    usual = f"{_told(first, p.unit)} to {_told(last, p.unit)}" if math.isfinite(first) and math.isfinite(last) else ""
    default = "may be left out" if p.optional else "required" if p.default is None else _told(p.default, p.unit)
    meaning = p.caption + (f" ({p.origin})" if p.origin else "")
    meaning += f"; prior {_told(p.prior_sd, p.unit)}" if p.prior_sd else ""
    return code(p.path), letters(p.symbol), code(p.unit), default, allowed, usual, plain(meaning)


def _told(value: float, unit: str) -> str:
    return plain(format_quantity(value, unit))


def _design() -> Iterator[str]:
    yield "\n## Design\n\nA vehicle, its contact, its effects and what its ride is judged by. One of three forms stands under "
    yield "`vehicle`: the bogie of six degrees of freedom, bodies and elements, or a one-mass rig.\n\n### The bogie\n\n"
    yield _numbers(VEHICLE)
    yield "\n### Contact\n\n"
    yield _numbers(CONTACT)
    yield f"\n`contact.gauge_widens_clearance`: {_choices('contact.gauge_widens_clearance')}.\n"
    yield "\n`contact.profiles`: measured profiles in the place of what the contact leaves out, see [contact](../contact.md).\n\n"
    yield table(KEYS, _keys(ProfilesModel.model_json_schema()))
    yield "\n### Riding\n\n"
    yield _numbers(RIDING)
    yield f"\n`riding.use`: {_choices('riding.use')}. What is left out follows from it:\n\n"
    rows = [(code(use), format_quantity(of["riding.journey"], "s"), of["riding.comfort_weight"]) for use, of in DEFAULTS_BY_USE.items()]
    yield table(("use", "journey", "comfort weight"), rows)
    yield "\n### Effects\n\nA list; every kind with its keys stands in the [catalogue](effects.md).\n"
    yield "\n### Adjustment\n\nWhat `railui loop` and `railui adjust` leave behind: `adjustment: {campaign, sha256, names, "
    yield "covariance}`, the paths that were adjusted and the covariance of their values in SI.\n"
    yield "\n### Bodies and elements\n\n`vehicle.bodies`, `vehicle.elements` and `vehicle.floor` are maps of names; an element has a "
    yield f"`kind`, one of {', '.join(map(code, ELEMENT_KINDS))}. Keys are relative to `vehicle.bodies.NAME` and `vehicle.elements.NAME`.\n"
    yield f"\n**body**\n\n{_numbers(BODY)}"
    for kind in ELEMENT_KINDS:
        words = word_keys(kind)
        told = f" Words: {', '.join(map(code, words))}." if words else ""
        yield f"\n**{kind}**.{told}\n\n{_numbers(parameters_of_kind(kind))}"
    yield f"\n**floor** (`vehicle.floor.NAME`): a point where comfort is felt. Words: `body`.\n\n{_numbers(POSITION)}"
    yield f"\n### Rig\n\nm z'' + c z' + k z + effects = gain u(t).\n\n{_numbers(RIG)}"
    yield f"\n`vehicle.rig.input`: {_choices('vehicle.rig.input')}. All numbers are in the run's own units.\n"


def _choices(path: str) -> str:
    first, *others = (str(choice).lower() if isinstance(choice, bool) else choice for choice in SETTINGS[path])
    return f"{code(first)} (default), {', '.join(map(code, others))}"


def _runs() -> Iterator[str]:
    yield "\n## Run\n\nCSV, also `.gz`, a row per sample, header `name [unit]`; decimal comma and semicolon are recognised. `t`, `v`, "
    yield "`yw` and one response are required; `loop` needs more to separate effects. A gap, an empty or stuck cell ends a stretch; stretches under 10 s are not used. Rows "
    yield "out of order, repeated time stamps and uneven intervals are errors with their line; so are speeds above 120 m/s and lateral "
    yield "motions of more than 0.2 m rms, which are km/h and mm by another name.\n\n"
    yield table(("column", "unit", "part", "meaning", "in nrmse"), [
        (code(c.name), code(c.unit), c.role, plain(c.caption), "yes" if c.name in COMPARED_CHANNELS else "") for c in COLUMNS.values()
    ])  # fmt: skip
    yield "\nOf a rig, in any unit, which is kept as a label:\n\n"
    yield table(("column", "unit", "part", "meaning"),
                [(code(c.name), code(c.unit) or "any", c.role, plain(c.caption)) for c in RIG_COLUMNS.values()])  # fmt: skip


def _campaign() -> Iterator[str]:
    yield "\n## Campaign\n\n`campaign.yaml` beside its runs. `sensors` takes the sensor effects of the [catalogue](effects.md).\n\n"
    keys = _keys(json_schema("campaign"))
    yield table(KEYS, [row for row in keys if not row[0].startswith("`settings.")])
    yield "\n`settings` takes the [thresholds of the loop](settings.md) by name.\n"
    for form, paths in DEFAULT_ESTIMATED.items():
        yield f"\n`adjust` of a {form} by default: {', '.join(map(code, paths))}.\n"


def _track() -> Iterator[str]:
    yield "\n## Track\n\nCSV with `s [m]`, `yw [m]` and optionally `phiw [rad]`, `gauge [m]`, equally spaced by 0.05 to 1 m; lines "
    yield "`#` before the header carry the conventions. A run is a track, too. Or a spec, wherever a track is asked for:\n\n"
    yield "```\nerri_b176_low length=2000 seed=1 spacing=0.1 shortest=3 longest=150 scale=1\n```\n\n"
    yield "These are the defaults, but for a length of 1000 m and seed 0. Densities are one-sided, per rad/m.\n\n"
    yield table(("name", "source"), [(code(name), plain(spectrum.source)) for name, spectrum in SPECTRA.items()])


def _study() -> Iterator[str]:
    yield "\n## Study\n\nCases are track x speed x seed x scenario (x draw from the covariance of the adjustment), aggregated over "
    yield "`mean`, `worst` or `p95`.\n\n"
    yield table(KEYS, _keys(json_schema("study")))


def _map() -> Iterator[str]:
    yield "\n## Map\n\nWhich channel of a recording is which sensor, how it is mounted, how the rails are reconstructed.\n\n"
    yield table(KEYS, _keys(MapModel.model_json_schema()))
    yield "\n`sensors.NAME` is one of:\n\n"
    yield table(("sensor", "unit", "meaning"), [(code(n), code(t.unit), plain(t.caption)) for n, t in QUANTITIES.items()])


def _results() -> Iterator[str]:
    yield "\n## Keys of results\n\nWhat the JSON of ride, stability and curve holds, and what a study may aim at or limit.\n\n"
    rows = [
        (code(r.key), r.analysis, "" if r.is_text else code(r.unit), "no" if r.is_text else "yes") for r in RESPONSE_KEYS.values()
    ]
    yield table(("key", "command", "unit", "a study may aim at it"), rows)
    yield "\nEvery key of every command, [with its unit](../results.md). Of a list the largest "
    yield "magnitude counts.\n"


def _keys(made: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Rows of a JSON Schema, groups written out."""
    definitions = made.get("$defs", {})

    def rows(node: Mapping[str, Any], path: str) -> Iterator[tuple[str, ...]]:
        for key, raw in node.get("properties", {}).items():
            field = _resolved(raw, definitions)
            here = f"{path}{key}"
            inner = _resolved(field.get("items", {}) or {}, definitions)
            values = field.get("additionalProperties")
            values = _resolved(values, definitions) if isinstance(values, dict) else {}
            if field.get("properties"):
                yield from rows(field, f"{here}.")
            elif inner.get("properties"):
                yield from rows(inner, f"{here}.0.")
            elif values.get("properties"):
                yield from rows(values, f"{here}.NAME.")
            else:
                required = key in node.get("required", ())
                yield code(here), _kind(field), "required" if required else _default(field), plain(_meaning(key, field))

    return list(rows(made, ""))


def _resolved(node: Mapping[str, Any], definitions: Mapping[str, Any]) -> Mapping[str, Any]:
    if "$ref" in node:
        return {**definitions[node["$ref"].rpartition("/")[2]], **{k: v for k, v in node.items() if k != "$ref"}}
    return node


def _kind(field: Mapping[str, Any]) -> str:
    if "enum" in field:
        return ", ".join(code(word) for word in field["enum"])
    if unit := field.get("unit"):
        return f"quantity, {code(unit)}"
    for choice in field.get("anyOf", ()):
        if choice.get("type") not in ("null", None):
            return "number or quantity" if choice["type"] == "number" else _kind(choice)
    kind = str(field.get("type", ""))
    low = f" from {field['minimum']}" if "minimum" in field else ""
    inner = field.get("items") or (field.get("prefixItems") or [{}])[0]
    of = f" of {_kind(inner)}" if kind == "array" and isinstance(inner, dict) and _kind(inner) else ""
    words = {"array": "list", "object": "map", "string": "text", "integer": "whole number", "number": "number"}
    return words.get(kind, kind) + low + of


def _default(field: Mapping[str, Any]) -> str:
    default = field.get("default")
    return "" if default in (None, "", [], {}) else code(default)


def _meaning(key: str, field: Mapping[str, Any]) -> str:
    title = str(field.get("title", ""))
    own = "" if title.lower() == key.replace("_", " ").strip() else title
    return ". ".join(part for part in (own, str(field.get("description", ""))) if part)
