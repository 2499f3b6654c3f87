"""railui effects: the model library of effects."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import click

from railui.cli.invocation import Invocation, common_options
from railui.cli.tables import make_table

# the bogie whose springs and dampers the defaults refer to, as in docs/files.md
REFERENCE_BOGIE = {
    "vehicle.frame.mass": 2900.0,
    "vehicle.geometry.half_spring_base": 1.0,
    "vehicle.geometry.rolling_radius": 0.46,
    "vehicle.primary.lateral_stiffness": 3.0e6,
    "vehicle.primary.longitudinal_stiffness": 8e6,
    "vehicle.secondary.lateral_stiffness": 0.2e6,
    "vehicle.secondary.yaw_stiffness": 0.2e6,
    "vehicle.secondary.lateral_damping": 30e3,
    "vehicle.secondary.yaw_damping": 30e3,
    "contact.flange_clearance": 7e-3,
}
# external forces on the frame are scaled by the spring that supports it
REFERENCE_LOCATIONS = {"frame": "secondary_lateral", "frame_yaw": "secondary_yaw"}
MAX_LISTED_LOCATIONS = 7
NOTE = "defaults, minima and maxima at the first location for the bogie of the examples; times: of which quantity"


def resolve_parameter(parameter: Mapping[str, Any], locations: list[str]) -> dict[str, Any]:
    """Return a parameter of a record with unit, default and range as numbers at its first location."""
    from railui.vehicle.effects import default_at, range_at, unit_at

    at = locations[0]
    reference = REFERENCE_LOCATIONS.get(at, at)
    low, high = range_at(parameter, reference, REFERENCE_BOGIE)
    default = default_at(parameter, reference, REFERENCE_BOGIE)
    if parameter["optional"]:  # a file without the key gets this number, unscaled
        default = float(parameter["default"])
    numbers = {"default": default, "minimum": low, "maximum": high}
    finite = {key: value if value is not None and math.isfinite(value) else None for key, value in numbers.items()}
    return {
        "key": str(parameter["key"]),
        "symbol": str(parameter["symbol"]),
        "unit": unit_at(str(parameter["unit"]), at),
        **finite,
        "origin": str(parameter["origin"]),
        "times": str(parameter["times"]),
        "role": str(parameter["role"]),
    }


def catalogue_entries() -> list[dict[str, Any]]:
    """Return the library as data: kind, title, at, source, parameters."""
    from railui.core import effect_catalogue

    entries = []
    for record in effect_catalogue():
        locations = [str(at) for at in record["at"]]
        entries.append(
            {
                "kind": str(record["kind"]),
                "title": str(record["title"]),
                "at": locations,
                "source": str(record["source"]),
                "parameters": [resolve_parameter(p, locations) for p in record["parameters"]],
            }
        )
    return entries


@click.command("effects")
@common_options
def command(call: Invocation) -> None:
    """List the effects of the model library: force laws that the linear model lacks, locations, parameters.

    Defaults and ranges are those at the first location, for the bogie of the examples; in the JSON, `times` names
    the quantity by which they are scaled.
    """
    entries = catalogue_entries()
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
