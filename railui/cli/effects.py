"""railui effects: the catalogue of effects."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import click

from railui.cli.common import Invocation, options

# the bogie whose springs and dampers the defaults are told in: that of the description of files
REFERENCE = {
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
# an outer force on the frame is told in terms of the spring that holds it
NEIGHBOURS = {"frame": "secondary_lateral", "frame_yaw": "secondary_yaw"}


def resolved(parameter: Mapping[str, Any], places: list[str]) -> dict[str, Any]:
    """A parameter of a record with unit, default and range as numbers at its first place."""
    from railui.vehicle.effect_records import default_at, range_at, unit_at

    at = places[0]
    site = NEIGHBOURS.get(at, at)
    low, high = range_at(parameter, site, REFERENCE)
    default = default_at(parameter, site, REFERENCE)
    if parameter["optional"]:  # a file that leaves it out gets the number as it is
        default = float(parameter["default"])
    numbers = {"default": default, "minimum": low, "maximum": high}
    told = {key: value if value is not None and math.isfinite(value) else None for key, value in numbers.items()}
    unit = unit_at(str(parameter["unit"]), at)
    words = {key: str(parameter[key]) for key in ("key", "symbol")}
    more = {"origin": str(parameter["origin"]), "times": str(parameter["times"])}
    return {**words, "unit": unit, **told, **more, "role": str(parameter["role"])}


def entries() -> list[dict[str, Any]]:
    """The catalogue as it is told: kind, title, at, source, parameters."""
    from railui.core import catalogue

    found = []
    for record in catalogue():
        places = [str(at) for at in record["at"]]
        told = {key: str(record[key]) for key in ("kind", "title")} | {"at": places, "source": str(record["source"])}
        found.append(told | {"parameters": [resolved(p, places) for p in record["parameters"]]})
    return found


@click.command("effects")
@options
def command(call: Invocation) -> None:
    """List the catalogue of effects: the laws that the linear model lacks, where they stand, their numbers.

    Defaults and ranges are those at the first place, for the bogie of the examples; `times` says what they
    are multiples of.
    """
    from rich.table import Table

    from railui.io.number_format import display

    found = entries()
    table = Table("kind", "what it is", "at", "parameters (default)", title="effects", title_justify="left")
    for effect in found:
        numbers = [
            p["key"] if p["default"] is None else f"{p['key']} ({display(p['default'], p['unit'])})"
            for p in effect["parameters"]
        ]
        places = effect["at"] if len(effect["at"]) < 8 else [*effect["at"][:3], "..."]
        table.add_row(effect["kind"], effect["title"], ", ".join(places), ", ".join(numbers))
    if call.json != "-":
        call.show(table)
    note = "defaults, minima and maxima at the first place for the bogie of the examples; times: of what"
    call.emit(call.document("effects", {"effects": found, "notes": [note]}))
