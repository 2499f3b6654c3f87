"""railui effects: the model library of effects."""

from __future__ import annotations

from typing import Any

import click

from railui.cli.invocation import Invocation, common_options, usage_error
from railui.cli.tables import make_table

MAX_LISTED_LOCATIONS = 7
NOTE = "defaults, minima and maxima at the first location for the bogie of the examples; times: of which quantity"


@click.command("effects")
@click.argument("kind", required=False)
@common_options
def command(kind: str | None, call: Invocation) -> None:
    """List the effects of the model library: force laws that the linear model lacks, locations, parameters.

    \b
    railui effects                 all of them
    railui effects free_play       one with its law and source, and the range and the origin of each default

    Defaults and ranges are those at the first location, for the bogie of the examples; in the JSON, `times` names
    the quantity by which they are scaled.
    """
    from railui.api.library import effects
    from railui.io.problems import suggest_name

    entries = effects()
    if kind is not None:
        known = [entry["kind"] for entry in entries]
        if kind not in known:
            raise usage_error(f"no effect {kind!r}, {suggest_name(kind, known)}")
        entries = [entry for entry in entries if entry["kind"] == kind]
    if kind is not None and call.json != "-":
        call.show(_parameter_table(entries[0]))
    elif call.json != "-":
        columns = ("kind", "description", "at", "parameters (default)")
        call.show(make_table(columns, map(_row, entries), title="effects"))
    call.write_json(call.document("effects", {"effects": entries, "notes": [NOTE]}))


def _parameter_table(effect: dict[str, Any]) -> Any:
    """Return the parameters of one effect with default, range and origin; its law, locations and source below."""
    from railui.io.number_format import format_quantity

    rows = []
    for p in effect["parameters"]:
        numbers = (p[key] for key in ("default", "minimum", "maximum"))
        cells = ["-" if x is None else format_quantity(x, p["unit"]) for x in numbers]
        rows.append((p["key"], p["symbol"], *cells, p["origin"]))
    caption = (
        f"law: {effect['law']}\nat: {', '.join(effect['at'])}\nsource: {effect['source']}\n{NOTE.partition(';')[0]}"
    )
    columns = ("parameter", "symbol", "default", "minimum", "maximum", "origin of the default")
    return make_table(columns, rows, title=f"{effect['kind']}, {effect['title']}", caption=caption)


def _row(effect: dict[str, Any]) -> tuple[str, ...]:
    from railui.io.number_format import format_quantity

    parameters = [
        p["key"] if p["default"] is None else f"{p['key']} ({format_quantity(p['default'], p['unit'])})"
        for p in effect["parameters"]
    ]
    at = effect["at"]
    listed = at if len(at) <= MAX_LISTED_LOCATIONS else [*at[:3], "..."]
    return effect["kind"], effect["title"], ", ".join(listed), ", ".join(parameters)
