"""Sensors of multibody vehicles: the channels that a run may contain, and those of the kernel that they measure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from railui.runs.columns import Column, VehicleColumns

if TYPE_CHECKING:
    from railui.vehicle.multibody import Structure
    from railui.vehicle.multibody_parts import Member


@dataclass(frozen=True)
class Accelerometer:
    """Lateral accelerometer on a body.

    Attributes
    ----------
    body
        Name of the rigid body.
    at
        Position forwards of and below its centre of mass [m].
    with_gravity
        True where its signal contains gravity through roll, y'' - g phi.
    """

    body: str
    at: tuple[float, float]
    with_gravity: bool


@dataclass(frozen=True)
class Sensor:
    """Sensor of a vehicle: the name of its channel in the runs, unit, caption, and the kernel's channel.

    A lateral accelerometer away from a centre of mass is a channel of its own in the kernel.
    """

    name: str
    unit: str
    caption: str
    channel: str
    accelerometer: Accelerometer | None = None


def standard_sensors(structure: Structure) -> tuple[Sensor, ...]:
    """Return the sensors whose channels have a name of their own, without any declaration.

    e1, ay1, d1, psi1 and so on by wheelset from the front; ayf and rf of the frame above the first wheelset; ay.BODY,
    rf.BODY, rp.BODY (roll rate) of every body; ay.BODY.POINT of every floor point, with gravity through roll.
    """
    return (*_of_wheelsets(structure), *_of_bodies(structure))


def vehicle_columns(structure: Structure) -> VehicleColumns:
    """Return the columns of the runs of a vehicle: those of its declared sensors, then the standard ones."""
    declared = {s.name for s in structure.sensors}
    sensors = (*structure.sensors, *(s for s in standard_sensors(structure) if s.name not in declared))
    return VehicleColumns(tuple(Column(s.name, s.unit, "response", s.caption) for s in sensors))


def kernel_names(structure: Structure) -> dict[str, str]:
    """Return the kernel's channel of every sensor whose channel is called otherwise in the runs."""
    sensors = (*standard_sensors(structure), *structure.sensors)
    return {s.name: s.channel for s in sensors if s.name != s.channel}


def rate_channel(member: Member, way: str) -> str:
    """Return the kernel's channel of the yaw or roll rate of a body."""
    family = "wheelset" if member.is_wheelset else member.part.name
    return f"v.{family}_{way}.{member.number}"


def _of_wheelsets(structure: Structure) -> Iterator[Sensor]:
    for wheelset in structure.wheelsets:
        n = wheelset.number
        yield Sensor(f"e{n}", "m", f"wheelset {n} relative to the rails", f"e{n}")
        yield Sensor(f"ay{n}", "m/s^2", f"acceleration of the axle boxes of wheelset {n}", f"ay{n}")
        if any(wheelset.name in joint.ends for joint in structure.joints):
            yield Sensor(f"d{n}", "m", f"deflection of the primary suspension of wheelset {n}", f"d{n}")
        yield Sensor(f"psi{n}", "rad", f"yaw of wheelset {n}", f"psi{n}")
    carrier = structure.wheelsets[0].carrier if structure.wheelsets else None
    if carrier is not None:
        yield Sensor("ayf", "m/s^2", "acceleration of the leading frame", "ayf")
        yield Sensor("rf", "rad/s", "yaw rate of the leading frame", "rf")


def _of_bodies(structure: Structure) -> Iterator[Sensor]:
    for member in structure.members.values():
        if member.is_wheelset:
            continue
        called = member.name.replace("_", " ")
        yield Sensor(f"ay.{member.name}", "m/s^2", f"lateral acceleration of {called}", f"ay.{member.name}")
        for letters, way in (("rf", "yaw"), ("rp", "roll")):
            if member.has_rotation(way):
                yield Sensor(f"{letters}.{member.name}", "rad/s", f"{way} rate of {called}", rate_channel(member, way))
    for point in structure.floor:
        body = structure.members_named(point.word("body"))[0].name
        caption = f"lateral acceleration of {body.replace('_', ' ')}, {point.name.replace('_', ' ')}"
        yield Sensor(f"ay.{body}.{point.name}", "m/s^2", caption, f"floor.{point.name}")
