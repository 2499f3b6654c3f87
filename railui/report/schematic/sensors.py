"""Places of the sensors of a campaign on its vehicle."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from railui.report.schematic.places import Places
from railui.vehicle.multibody_parts import Joint, Member
from railui.vehicle.sensors import Sensor, rate_channel, standard_sensors

QUANTITIES = {"m/s^2": "acceleration", "rad/s": "rate", "m": "displacement", "rad": "angle"}


@dataclass(frozen=True)
class SensorPlace:
    """Sensor with its place [m]: x on the drawn axis, y to the right."""

    name: str
    caption: str
    quantity: str
    x: float
    y: float


def sensor_places(places: Places, channels: Sequence[str], lateral: Mapping[str, float]) -> list[SensorPlace]:
    """Return the places of sensors by the names of their channels, without those that the vehicle has not.

    `lateral` holds the y [m] of accelerometers away from the middle, which no lateral acceleration depends on.
    """
    structure = places.structure
    known = {s.name: s for s in (*standard_sensors(structure), *structure.sensors)}
    found = []
    for name in dict.fromkeys(channels):
        place = _place(places, known[name]) if name in known else None
        if place is not None:
            x, y = place
            quantity = QUANTITIES.get(known[name].unit, "angle")
            found.append(SensorPlace(name, known[name].caption, quantity, x, lateral.get(name, y)))
    return found


def _place(places: Places, sensor: Sensor) -> tuple[float, float] | None:
    members = places.structure.members
    if sensor.accelerometer is not None:
        body = members[sensor.accelerometer.body]
        return places.axis(places.x_of_member(body) + sensor.accelerometer.at[0]), 0.0
    if match := re.fullmatch(r"(e|ay|d|psi)(\d+)", sensor.channel):
        return _at_wheelset(places, match[1], places.structure.wheelsets[int(match[2]) - 1])
    family, _, name = sensor.channel.partition(".")
    if family == "floor":
        point = next(p for p in places.structure.floor if p.name == name)
        x = places.values[point.number_path("x")] if "x" in point.keys else _x_of_body(places, point.word("body"))
        return places.axis(x), 0.0
    if family == "z":
        joint = _joint_at(places, name)
        return None if joint is None else (places.axis(places.x_of_joint(joint)), min(places.sides_of_joint(joint)))
    member = _member_of(places, sensor)
    return None if member is None else (places.axis(places.x_of_member(member)), 0.0)


def _at_wheelset(places: Places, quantity: str, wheelset: Member) -> tuple[float, float]:
    """Displacement at the left wheel, acceleration and deflection at the left axle box, yaw in the middle."""
    y = {"e": -places.half_gauge(wheelset), "psi": 0.0}.get(quantity, -places.box_distance(wheelset))
    return places.axis(places.x_of_member(wheelset)), y


def _x_of_body(places: Places, name: str) -> float:
    return places.x_of_member(places.structure.members_named(name)[0])


def _joint_at(places: Places, location: str) -> Joint | None:
    """Return the joint of a kernel channel such as `secondary_lateral.2`."""
    name, _, number = location.rpartition(".")
    for joint in places.structure.joints:
        if name in joint.locations and joint.number == int(number):
            return joint
    return None


def _member_of(places: Places, sensor: Sensor) -> Member | None:
    """Return the body whose acceleration, yaw rate or roll rate a sensor measures."""
    members = places.structure.members
    if sensor.channel in ("ayf", "rf"):
        carrier = places.structure.wheelsets[0].carrier
        return None if carrier is None else members[carrier]
    for member in members.values():
        rates = {rate_channel(member, way) for way in ("yaw", "roll")}
        if sensor.channel in rates or sensor.channel == f"ay.{member.name}":
            return member
    return None
