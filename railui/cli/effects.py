"""railui effects: the model library of effects."""

from __future__ import annotations

from typing import Any

import click

from railui.cli.invocation import Invocation, common_options
from railui.cli.tables import make_table

MAX_LISTED_LOCATIONS = 7
NOTE = "defaults, minima and maxima at the first location for the bogie of the examples; times: of which quantity"


@click.command("effects")
@common_options
def command(call: Invocation) -> None:
    """List the effects of the model library: force laws that the linear model lacks, locations, parameters.

    Defaults and ranges are those at the first location, for the bogie of the examples; in the JSON, `times` names
    the quantity by which they are scaled.
    """
    from railui.api.library import effects

    entries = effects()
    if call.json != "-":
        columns = ("kind", "description", "at", "parameters (default)")
        call.show(make_table(columns, map(_row, entries), title="effects"))
    call.write_json(call.document("effects", {"effects": entries, "notes": [NOTE]}))


def _row(effect: dict[str, Any]) -> tuple[str, ...]:
    from railui.io.number_format import format_quantity

    parameters = [
        p["key"] if p["default"] is None else f"{p['key']} ({format_quantity(p['default'], p['unit'])})"
        for p in effect["parameters"]
    ]
    at = effect["at"]
    listed = at if len(at) <= MAX_LISTED_LOCATIONS else [*at[:3], "..."]
    return effect["kind"], effect["title"], ", ".join(listed), ", ".join(parameters)
