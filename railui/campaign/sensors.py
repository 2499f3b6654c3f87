"""Sensors that a campaign declares on a vehicle of bodies, by the names of their columns."""

from __future__ import annotations

from typing import Any, Final

from railui.io.problems import Findings, suggest_name
from railui.io.units import UnitError, quantity
from railui.runs.columns import COLUMNS
from railui.vehicle.multibody import Structure
from railui.vehicle.sensors import Accelerometer, Sensor, rate_channel

_RATES: Final = {"yaw_rate": "yaw", "roll_rate": "roll"}
# direction of the motion and its unit
_DEFLECTIONS: Final = {"lateral_deflection": ("lateral", "m"), "yaw_deflection": ("yaw", "rad")}
ACCELERATION: Final = "lateral_acceleration"
SENSOR_KINDS: Final = (ACCELERATION, *_RATES, *_DEFLECTIONS)


def read_position(value: Any) -> Any:
    """Return a position [x, y, z] as a list; UnitError for anything else."""
    if value is None or value == []:
        return []
    if not isinstance(value, list) or len(value) != 3:
        raise UnitError("is not a position", "write [x, y, z] from the centre of mass: forwards, to the right, down")
    return value


def read_sensors(raw: Any, structure: Structure, findings: Findings) -> tuple[Sensor, ...]:
    """Read `channels:` of a campaign; findings receives every sensor that the vehicle cannot have."""
    sensors = [
        _read(name, entry, structure, findings)
        for name, entry in (raw.items() if isinstance(raw, dict) else ())
        if isinstance(entry, dict) and entry.get("kind") in SENSOR_KINDS  # anything else is reported by the schema
    ]
    return tuple(s for s in sensors if s is not None)


def _read(name: str, entry: dict[str, Any], structure: Structure, findings: Findings) -> Sensor | None:
    path, kind = f"channels.{name}", str(entry["kind"])
    if name in COLUMNS and COLUMNS[name].role != "response":
        findings.add(path, f"{name} is the name of another column", "give the sensor another name", key=True)
        return None
    if kind in _DEFLECTIONS:
        return _deflection(name, kind, entry, path, structure, findings)
    bodies = list(structure.members)
    body = str(entry.get("body", ""))
    if body not in bodies:
        remedy = suggest_name(body, bodies) if body else f"add `body:`, one of {', '.join(bodies)}"
        findings.add(f"{path}.body" if body else path, f"no body {body!r}" if body else "has no body", remedy)
        return None
    if kind == ACCELERATION:
        return _accelerometer(name, entry, body)
    member, way = structure.members[body], _RATES[kind]
    if not member.has_rotation(way):
        findings.add(f"{path}.kind", f"{body} has no {way} inertia and does not {way}", "leave the channel out")
        return None
    return Sensor(name, "rad/s", f"{way} rate of {body.replace('_', ' ')}", rate_channel(member, way))


def _accelerometer(name: str, entry: dict[str, Any], body: str) -> Sensor:
    at = entry.get("at") or [0.0, 0.0, 0.0]
    try:
        x, _, z = (quantity(number, "m") for number in at)
    except (UnitError, TypeError, ValueError):  # reported by the schema
        x = z = 0.0
    caption = f"lateral acceleration of {body.replace('_', ' ')} at x {x:g} m, z {z:g} m"
    gravity = entry.get("gravity") is True
    return Sensor(name, "m/s^2", caption, f"sensor.{name}", Accelerometer(body, (x, z), gravity))


def _deflection(
    name: str, kind: str, entry: dict[str, Any], path: str, structure: Structure, findings: Findings
) -> Sensor | None:
    """Read a deflection of a joint: `primary_3` is that of wheelset 3 or the third joint, `centre_pivot` the only."""
    end, unit = _DEFLECTIONS[kind]
    joints = {f"{j.part.name}_{j.number}" if j.number else j.part.name: j for j in structure.joints}
    given = str(entry.get("joint", ""))
    if given not in joints:
        remedy = suggest_name(given, joints) if given else f"add `joint:`, one of {', '.join(joints)}"
        findings.add(f"{path}.joint" if given else path, f"no joint {given!r}" if given else "has no joint", remedy)
        return None
    joint = joints[given]
    location = joint.part.name if joint.part.kind == "link" else f"{joint.part.name}_{end}"
    return Sensor(name, unit, f"{end} deflection of {given.replace('_', ' ')}", f"z.{location}.{joint.number}")
