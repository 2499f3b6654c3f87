"""Page of the file formats: every key with unit, range and default, from the models that check the files."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from markdown_text import code, plain, symbol, table

from railui.capture.processing.map_schema import QUANTITIES, MapModel
from railui.documents.schema import json_schema
from railui.io.number_format import format_quantity
from railui.optimisation.response_keys import RESPONSE_KEYS
from railui.runs.columns import BENCH_COLUMNS, COLUMNS, COMPARED_CHANNELS, RIG_COLUMNS
from railui.track.spectra import SPECTRA
from railui.vehicle.element_kinds import BODY, ELEMENT_KINDS, POSITION, parameters_of_kind
from railui.vehicle.multibody_reader import word_keys
from railui.vehicle.parameter import MAX_PLAUSIBLE, Parameter
from railui.vehicle.parameters import (
    CONTACT,
    DEFAULT_ESTIMATED,
    DEFAULTS_BY_USE,
    RIDING,
    RIG,
    SETTINGS,
    VEHICLE,
)
from railui.vehicle.profiles_schema import ProfilesModel

NUMBERS = ("key", "letter", "unit", "default", "allowed", "usual", "meaning")
KEYS = ("key", "kind", "default", "meaning")
INTRODUCTION = """# Files

The format is YAML 1.2: `1e6` is a number, `on` a text, a duplicate key an error. A quantity is a number in SI or a text with a unit
(`30 kN*s/m`); a unit of another dimension is an error. The message on an unknown key names the nearest known one. All problems of a file are
reported together as file:line:column. Files written by railui begin with `schema: railui.KIND/1`; readers accept files without this line and
reject a newer number. Files are written atomically. `railui schema design` prints the JSON Schema with which an editor checks and completes a design.

The name of a parameter is its path from the root, the same in files, overrides, studies and reports:
`vehicle.primary.lateral_stiffness`, `effects.0.half_width`. Where `adjust` or an override accepts a group, its path selects all
parameters below it.
"""


def page() -> str:
    """Return a section for each format."""
    files = (_design(), _runs(), _campaign(), _track(), _line(), _study(), _element(), _map(), _results())
    return "".join([INTRODUCTION, *(part for file in files for part in file)])


def _numbers(parameters: tuple[Parameter, ...]) -> str:
    return table(NUMBERS, [_number(p) for p in parameters])


def _number(p: Parameter) -> tuple[str, ...]:
    low, high = p.minimum, p.maximum if p.maximum < MAX_PLAUSIBLE else math.inf
    allowed = f"{'above' if p.exclusive_minimum else 'from'} {_quantity(low, p.unit)}" if math.isfinite(low) else ""
    allowed += f" to {_quantity(high, p.unit)}" if math.isfinite(high) else ""
    first, last = p.usual_range
    usual = (
        f"{_quantity(first, p.unit)} to {_quantity(last, p.unit)}"
        if math.isfinite(first) and math.isfinite(last)
        else ""
    )
    default = "may be left out" if p.optional else "required" if p.default is None else _quantity(p.default, p.unit)
    meaning = p.caption + (f" ({p.origin})" if p.origin else "")
    meaning += f"; prior {_quantity(p.prior_sd, p.unit)}" if p.prior_sd else ""
    return code(p.path), symbol(p.symbol), code(p.unit), default, allowed, usual, plain(meaning)


def _quantity(value: float, unit: str) -> str:
    return plain(format_quantity(value, unit))


def _design() -> Iterator[str]:
    yield "\n## Design\n\nA vehicle, its contact, its effects and the criteria of its ride quality. `vehicle` has one of three forms: "
    yield "the bogie of six degrees of freedom, bodies and elements, or a one-mass rig.\n\n### The bogie\n\n"
    yield _numbers(VEHICLE)
    yield "\n### Contact\n\n"
    yield _numbers(CONTACT)
    yield f"\n`contact.gauge_widens_clearance`: {_choices('contact.gauge_widens_clearance')}.\n"
    yield "\n`contact.profiles`: measured profiles, from which the omitted contact parameters are computed, see [contact](../contact.md).\n\n"
    yield table(KEYS, _keys(ProfilesModel.model_json_schema()))
    yield "\n### Riding\n\n"
    yield _numbers(RIDING)
    yield f"\n`riding.use`: {_choices('riding.use')}. It sets the defaults of:\n\n"
    rows = [
        (code(use), format_quantity(of["riding.journey"], "s"), of["riding.comfort_weight"])
        for use, of in DEFAULTS_BY_USE.items()
    ]
    yield table(("use", "journey", "comfort weight"), rows)
    yield "\n### Effects\n\nA list; the [catalogue](effects.md) describes every kind with its keys.\n"
    yield "\n### Adjustment\n\nWritten by `railui loop` and `railui adjust`: `adjustment: {campaign, sha256, names, "
    yield "covariance}`, the paths of the estimated parameters and the covariance of their values in SI.\n"
    yield "\n### Bodies and elements\n\n`vehicle.bodies`, `vehicle.elements` and `vehicle.floor` are maps of names; an element has a "
    yield f"`kind`, one of {', '.join(map(code, ELEMENT_KINDS))}. Keys are relative to `vehicle.bodies.NAME` and `vehicle.elements.NAME`.\n"
    yield f"\n**body**\n\n{_numbers(BODY)}"
    for kind in ELEMENT_KINDS:
        keys = word_keys(kind)
        note = f" Text keys: {', '.join(map(code, keys))}." if keys else ""
        yield f"\n**{kind}**.{note}\n\n{_numbers(parameters_of_kind(kind))}"
    yield f"\n**floor** (`vehicle.floor.NAME`): a point at which comfort is evaluated. Text key: `body`.\n\n{_numbers(POSITION)}"
    yield f"\n### Rig\n\nm z'' + c z' + k z + preload + effects = gain u(t); with `input: motion` F = k z + c z' + preload + effects, without mass and gain.\n\n{_numbers(RIG)}"
    yield f"\n`vehicle.rig.input`: {_choices('vehicle.rig.input')}. All numbers are in the units of the run.\n"


def _choices(path: str) -> str:
    first, *others = (str(choice).lower() if isinstance(choice, bool) else choice for choice in SETTINGS[path])
    return f"{code(first)} (default), {', '.join(map(code, others))}"


def _runs() -> Iterator[str]:
    yield "\n## Run\n\nCSV, also `.gz`, a row per sample, header `name [unit]`; decimal comma and semicolon are recognised. `t`, `v`, "
    yield "`yw` and one response are required; `phiw` counts as zero without its column, and the motion that cross-level causes then remains unexplained. A gap, an empty or stuck cell ends a segment; segments shorter than 10 s are not used. Rows "
    yield "out of order, repeated time stamps and uneven intervals are errors with their line; so are speeds above 120 m/s and lateral "
    yield "motions of more than 0.2 m rms, which are usually km/h and mm without their unit.\n\n"
    yield table(("column", "unit", "role", "meaning", "in nrmse"), [
        (code(c.name), code(c.unit), c.role, plain(c.caption), "yes" if c.name in COMPARED_CHANNELS else "") for c in COLUMNS.values()
    ])  # fmt: skip
    yield "\nColumns of a rig, in any unit; the unit is a label only:\n\n"
    yield table(("column", "unit", "role", "meaning"),
                [(code(c.name), code(c.unit) or "any", c.role, plain(c.caption)) for c in RIG_COLUMNS.values()])  # fmt: skip
    yield "\nColumns of a component on a bench (`input: motion`); known units of motion and force are converted to SI:\n\n"
    yield table(("column", "unit", "role", "meaning"),
                [(code(c.name), code(c.unit) or "any", c.role, plain(c.caption)) for c in BENCH_COLUMNS.values()])  # fmt: skip


def _campaign() -> Iterator[str]:
    yield "\n## Campaign\n\n`campaign.yaml` in the directory of its runs. `sensors` lists the sensor effects of the [catalogue](effects.md).\n\n"
    keys = _keys(json_schema("campaign"))
    yield table(KEYS, [row for row in keys if not row[0].startswith("`settings.")])
    yield "\n`settings` sets [thresholds of the loop](settings.md) by name.\n"
    for form, paths in DEFAULT_ESTIMATED.items():
        yield f"\nDefault of `adjust` for a {form}: {', '.join(map(code, paths))}.\n"


def _track() -> Iterator[str]:
    yield "\n## Track\n\nCSV with `s [m]`, `yw [m]` and optionally `phiw [rad]`, `gauge [m]`, `curvature [1/m]`, `cant [m]`, equally spaced by 0.05 to 1 m; lines "
    yield "`#` before the header state the conventions. A run is also accepted as a track. A specification can replace the file:\n\n"
    yield "```\nerri_b176_low length=2000 seed=1 spacing=0.1 shortest=3 longest=150 scale=1\n```\n\n"
    yield "These are the defaults, except that the default length is 1000 m and the default seed 0. Densities are one-sided, per rad/m.\n\n"
    yield table(("name", "source"), [(code(name), plain(spectrum.source)) for name, spectrum in SPECTRA.items()])


def _line() -> Iterator[str]:
    yield "\n## Line\n\nA [line with curves](../lines.md), which `--track` takes in the place of a track.\n\n"
    yield table(KEYS, _keys(json_schema("line")))


def _study() -> Iterator[str]:
    yield "\n## Study\n\nCases are track x speed x seed x scenario (x draw from the covariance of the adjustment), aggregated over "
    yield "`mean`, `worst` or `p95`.\n\n"
    yield table(KEYS, _keys(json_schema("study")))


def _element() -> Iterator[str]:
    yield "\n## Element\n\nA component of a bench: identified, as `railui loop --export-element` writes it, or the table of a data sheet. A design mounts it by "
    yield "`effects: [{element: FILE, at: LOCATION, count: N}]`, see [a component on a bench](../component_bench.md); instead of FILE the keys may stand "
    yield "there. A CSV with the columns `v [m/s],F [N]` (or `z [m],F [N]`) is an element as well. The `effects` of an element have no location.\n\n"
    yield table(KEYS, _keys(json_schema("element")))


def _map() -> Iterator[str]:
    yield "\n## Map\n\nThe sensor of each channel of a recording, its mounting, and the reconstruction of the rails.\n\n"
    yield table(KEYS, _keys(MapModel.model_json_schema()))
    yield "\n`sensors.NAME` is one of:\n\n"
    yield table(
        ("sensor", "unit", "meaning"), [(code(n), code(t.unit), plain(t.caption)) for n, t in QUANTITIES.items()]
    )


def _results() -> Iterator[str]:
    yield "\n## Keys of results\n\nKeys in the JSON of ride, stability and curve, and the objectives and constraints of a study.\n\n"
    rows = [
        (code(r.key), r.analysis, "" if r.is_text else code(r.unit), "no" if r.is_text else "yes")
        for r in RESPONSE_KEYS.values()
    ]
    yield table(("key", "command", "unit", "allowed as an objective"), rows)
    yield "\n[Results](../results.md) lists every key of every command with its unit. Of a list the value of "
    yield "largest magnitude is used.\n"


def _keys(made: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Rows of a JSON Schema, groups written out."""
    definitions = made.get("$defs", {})

    def rows(node: Mapping[str, Any], path: str) -> Iterator[tuple[str, ...]]:
        for key, raw in node.get("properties", {}).items():
            field = _resolve(raw, definitions)
            key_path = f"{path}{key}"
            inner = _resolve(field.get("items", {}) or {}, definitions)
            values = field.get("additionalProperties")
            values = _resolve(values, definitions) if isinstance(values, dict) else {}
            if field.get("properties"):
                yield from rows(field, f"{key_path}.")
            elif inner.get("properties"):
                yield from rows(inner, f"{key_path}.0.")
            elif values.get("properties"):
                yield from rows(values, f"{key_path}.NAME.")
            else:
                required = key in node.get("required", ())
                yield (
                    code(key_path),
                    _kind(field),
                    "required" if required else _default(field),
                    plain(_meaning(key, field)),
                )

    return list(rows(made, ""))


def _resolve(node: Mapping[str, Any], definitions: Mapping[str, Any]) -> Mapping[str, Any]:
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
    names = {"array": "list", "object": "map", "string": "text", "integer": "whole number", "number": "number"}
    return names.get(kind, kind) + low + of


def _default(field: Mapping[str, Any]) -> str:
    default = field.get("default")
    return "" if default in (None, "", [], {}) else code(default)


def _meaning(key: str, field: Mapping[str, Any]) -> str:
    title = str(field.get("title", ""))
    heading = "" if title.lower() == key.replace("_", " ").strip() else title
    return ". ".join(part for part in (heading, str(field.get("description", ""))) if part)
