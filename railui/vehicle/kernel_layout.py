"""Kernel layout of a multibody design: every number by its index in the row."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from railui.core import (
    AccelerometerLayout,
    BodyLayout,
    FloorLayout,
    JointLayout,
    KernelPoint,
    Layout,
    LinearSum,
    WheelsLayout,
)
from railui.vehicle.element_kinds import DIRECTIONS
from railui.vehicle.multibody import Structure, position_terms
from railui.vehicle.multibody_parts import Joint, Member, Part

# lambda, kappa_x, kappa_y, epsilon, delta, sigma
CONTACT = (
    *("conicity", "longitudinal_creep", "lateral_creep"),
    *("gravitational_stiffness", "contact_angle", "roll"),
)


@cache
def structure_paths(structure: Structure) -> tuple[str, ...]:
    """Return the paths of a vehicle's numbers in the order of its row."""
    return tuple(structure.parameters)


@cache
def kernel_layout(structure: Structure) -> Layout:
    """Return the kernel layout of a structure; its numbers have the order of `structure_paths`."""
    return _LayoutBuilder(structure, {path: i for i, path in enumerate(structure_paths(structure))}).layout()


class _LayoutBuilder:
    def __init__(self, structure: Structure, columns: Mapping[str, int]) -> None:
        self.structure, self.columns = structure, columns
        self.index = {name: i for i, name in enumerate(structure.members)}

    def layout(self) -> Layout:
        bodies = [self.body(member) for member in self.structure.members.values()]
        joints = [self.joint(joint) for joint in self.structure.joints]
        floor = [self.floor(part) for part in self.structure.floor]
        return Layout(len(self.columns), bodies, joints, floor, self.accelerometers())

    def accelerometers(self) -> list[AccelerometerLayout]:
        sensors = [(s.channel, s.accelerometer) for s in self.structure.sensors if s.accelerometer is not None]
        return [AccelerometerLayout(name, self.index[a.body], a.at, a.with_gravity) for name, a in sensors]

    def number(self, part: Part, key: str, joint: int = 0) -> LinearSum:
        """Return the index of a part's number, at one of its joints where it differs; empty if it has none."""
        return self.column(part.number_path(key), joint) if key in part.keys else []

    def column(self, path: str, number: int) -> LinearSum:
        return [(1.0, self.columns[self.structure.path_at(path, number)])]

    def x(self, member: Member) -> LinearSum:
        return [(factor, self.columns[path]) for factor, path in position_terms(self.structure, member)]

    def height(self, member: Member) -> LinearSum:
        return self.number(member.part, "rolling_radius" if member.is_wheelset else "height")

    def body(self, member: Member) -> BodyLayout:
        part = member.part
        return BodyLayout(
            name=member.name,
            family=part.name,
            number=member.number,
            mass=self.number(part, "mass"),
            yaw_inertia=self.number(part, "yaw_inertia") or None,
            roll_inertia=self.number(part, "roll_inertia") or None,
            x=self.x(member),
            height=self.height(member),
            wheels=self.wheels(member) if member.is_wheelset else None,
        )

    def wheels(self, member: Member) -> WheelsLayout:
        part, group = member.part, self.structure.contact_of(member)
        return WheelsLayout(
            spin_inertia=self.number(part, "spin_inertia"),
            half_gauge=self.number(part, "half_gauge"),
            rolling_radius=self.number(part, "rolling_radius"),
            wheel_load=self.number(part, "wheel_load"),
            contact=[self.column(f"contact.{group}.{key}", member.number) for key in CONTACT],
            spin_creep=[(1.0, self.columns["contact.spin_creep"])],
            roller_radius=self.number(part, "roller_radius"),
        )

    def joint(self, joint: Joint) -> JointLayout:
        part = joint.part
        member = next(self.structure.members[name] for name in joint.ends if name is not None)
        first = self.point(part, "", (self.x(member), [], self.height(member)))
        points = first, self.point(part, "_to", first) if part.kind == "link" else first
        ends = [None if end is None else self.index[end] for end in joint.ends]
        mirrored, carried = self.structure.is_mirrored(part), self.number(part, "static_load", joint.number)
        return JointLayout(part.name, joint.number, (ends[0], ends[1]), points, mirrored, self.terms(joint), carried)

    def point(self, part: Part, end: str, otherwise: KernelPoint) -> KernelPoint:
        """Return the attachment point of an element; absent coordinates are those of `otherwise`."""
        given = [self.number(part, f"{key}{end}") for key in ("x", "y", "height")]
        if part.word("side") == "left":
            given[1] = [(-factor, i) for factor, i in given[1]]
        x, y, height = (coordinate or default for coordinate, default in zip(given, otherwise, strict=True))
        return x, y, height

    def terms(self, joint: Joint) -> list[tuple[str, str, list[LinearSum]]]:
        part = joint.part

        def of(*keys: str) -> list[LinearSum]:
            return [self.number(part, key, joint.number) for key in keys]

        if part.kind == "spring":
            return [(way, "spring", of(f"{way}_stiffness")) for way in DIRECTIONS]
        if part.kind == "damper":
            return [(way, "damper", of(f"{way}_damping")) for way in DIRECTIONS]
        if part.kind == "link":
            return [("along", "spring", of("stiffness")), ("along", "damper", of("damping"))]
        if part.kind == "anti_roll_bar":
            return [("roll", "spring", of("stiffness"))]
        direction = part.word("direction", "lateral")
        if part.kind == "stop":
            return [(direction, "stop", of("gap", "stiffness"))]
        return [(direction, "series", of("stiffness", "damping", "blow_off"))]

    def floor(self, part: Part) -> FloorLayout:
        member = self.structure.members_named(part.word("body"))[0]
        x, height = (self.number(part, key) for key in ("x", "height"))
        return FloorLayout(part.name, self.index[member.name], (x, [], height or self.height(member)))
