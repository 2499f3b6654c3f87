"""Layout of a multibody vehicle for the kernel, which reads these records as JSON, by the names of their fields."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from functools import cached_property

LinearSum = list[tuple[float, int]]  # sum of factor times number of the row, by index; empty for 0
KernelPoint = tuple[LinearSum, LinearSum, LinearSum]  # x forwards, y to the right, height above the rails


@dataclass(frozen=True)
class WheelsLayout:
    """Wheels of a wheelset; contact: conicity, creep (longitudinal, lateral), gravity, angle, roll.

    roller_radius: empty where the wheels run on a track.
    """

    spin_inertia: LinearSum
    half_gauge: LinearSum
    rolling_radius: LinearSum
    wheel_load: LinearSum
    contact: list[LinearSum]
    spin_creep: LinearSum
    roller_radius: LinearSum


@dataclass(frozen=True)
class BodyLayout:
    """Rigid body; without a yaw or roll inertia it has no such degree of freedom."""

    name: str
    family: str
    number: int
    mass: LinearSum
    yaw_inertia: LinearSum | None
    roll_inertia: LinearSum | None
    x: LinearSum
    height: LinearSum
    wheels: WheelsLayout | None = None


@dataclass(frozen=True)
class JointLayout:
    """Element between two bodies; terms: (direction, "spring" | "damper" | "series" | "stop", numbers)."""

    name: str
    number: int
    bodies: tuple[int | None, int | None]
    points: tuple[KernelPoint, KernelPoint]
    mirrored: bool
    terms: list[tuple[str, str, list[LinearSum]]]
    static_load: LinearSum


@dataclass(frozen=True)
class FloorLayout:
    """Floor point at which comfort is evaluated."""

    name: str
    body: int
    point: KernelPoint


@dataclass(frozen=True)
class AccelerometerLayout:
    """Lateral accelerometer on a body, forwards of and below its centre of mass [m]."""

    name: str
    body: int
    at: tuple[float, float]
    with_gravity: bool


@dataclass(frozen=True)
class Layout:
    """Vehicle of bodies (wheelsets from the front) and joints, with `numbers` numbers in a row."""

    numbers: int
    bodies: list[BodyLayout]
    joints: list[JointLayout]
    floor: list[FloorLayout]
    accelerometers: list[AccelerometerLayout]

    @cached_property
    def json(self) -> str:
        """Text of the layout, every digit of its numbers included."""
        return json.dumps(asdict(self))
