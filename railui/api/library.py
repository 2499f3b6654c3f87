"""Library of effects as data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

# the bogie whose springs and dampers the defaults refer to, as in docs/files.md
REFERENCE_BOGIE: Final = {
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
REFERENCE_LOCATIONS: Final = {"frame": "secondary_lateral", "frame_yaw": "secondary_yaw"}


def effects() -> list[dict[str, Any]]:
    """List the effects of the model library, as `railui effects`.

    Returns
    -------
    list of dict
        kind, title, at (locations), source, law (formula) and parameters: key, symbol, unit, default, minimum and
        maximum at the first location for the bogie of the examples, origin, times (quantity by which they are scaled),
        role.

    Examples
    --------
    >>> [effect["at"] for effect in effects() if effect["kind"] == "flange_contact"]
    [['contact']]
    """
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
                "law": str(record["law"]),
                "parameters": [resolve_parameter(p, locations) for p in record["parameters"]],
            }
        )
    return entries


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
