"""Places of bodies and elements in a plan view, in metres: x forwards on the drawn axis, y to the right."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from railui.report.schematic.axis import LongitudinalAxis, longitudinal_axis
from railui.vehicle.multibody import Structure, position
from railui.vehicle.multibody_parts import Joint, Member

AXLE_BOX_DISTANCE = 0.27  # m, least drawn distance of an axle box from the middle of its wheel
DEFAULT_HALF_BASE = 1.0  # m, of the axle boxes where no element has a y


@dataclass(frozen=True)
class Places:
    """Places of the parts of a vehicle."""

    structure: Structure
    values: Mapping[str, float]

    @cached_property
    def axis(self) -> LongitudinalAxis:
        """The drawn longitudinal axis."""
        return longitudinal_axis(self.x_of_member(w) for w in self.structure.wheelsets)

    def x_of_member(self, member: Member) -> float:
        """Return the position of a body along the vehicle [m]."""
        return position(self.structure, member, self.values)

    def half_gauge(self, wheelset: Member) -> float:
        """Return half the distance of the rolling circles [m]."""
        return self.values[wheelset.part.number_path("half_gauge")]

    def rolling_radius(self, wheelset: Member) -> float:
        """Return the rolling radius [m]."""
        return self.values[wheelset.part.number_path("rolling_radius")]

    def box_distance(self, wheelset: Member) -> float:
        """Return the drawn distance of the axle boxes from the middle of the vehicle [m], clear of the wheels."""
        joints = [joint for joint in self.structure.joints if wheelset.name in joint.ends and "y" in joint.part.keys]
        given = [self.values[joint.part.number_path("y")] for joint in joints if joint.part.kind != "link"]
        return self._clear_of_wheels(given[0] if given else DEFAULT_HALF_BASE, wheelset)

    def _clear_of_wheels(self, y: float, wheelset: Member) -> float:
        b = self.half_gauge(wheelset)
        return max(y, b + AXLE_BOX_DISTANCE) if y >= b else min(y, b - AXLE_BOX_DISTANCE)

    def x_of_joint(self, joint: Joint) -> float:
        """Return the position of an element along the vehicle [m], by default that of its first body."""
        if "x" in joint.part.keys:
            return self.values[joint.part.number_path("x")]
        ends = [end for end in joint.ends if end is not None]
        return self.x_of_member(self.structure.members[ends[0]]) if ends else 0.0

    def sides_of_joint(self, joint: Joint) -> list[float]:
        """Return the drawn lateral positions of an element [m]: one on each side, on one side, or in the middle."""
        if "y" not in joint.part.keys:
            return [0.0]
        y = self.values[joint.part.number_path("y")]
        wheelsets = [self.structure.members[e] for e in joint.ends if e and self.structure.members[e].is_wheelset]
        if wheelsets and joint.part.kind != "link":
            y = self._clear_of_wheels(y, wheelsets[0])
        if self.structure.is_mirrored(joint.part):
            return [y, -y]
        return [-y if joint.part.word("side") == "left" else y]

    @cached_property
    def levels(self) -> dict[str, int]:
        """Level of every body: 0 of wheelsets, 1 of the bodies next to them, and so on upwards."""
        found = {w.name: 0 for w in self.structure.wheelsets}
        found |= {w.carrier: 1 for w in self.structure.wheelsets if w.carrier is not None}
        pairs = [[e for e in joint.ends if e is not None] for joint in self.structure.joints]
        for _ in self.structure.members:
            for pair in pairs:
                for here, there in (pair, pair[::-1]) if len(pair) == 2 else ():
                    if here in found and there not in found:
                        found[there] = found[here] + 1
        return {name: found.get(name, 1) for name in self.structure.members}

    @property
    def has_ground(self) -> bool:
        """True if an element is attached to a body that stands still."""
        return any(None in joint.ends for joint in self.structure.joints)

    @property
    def ground_title(self) -> str:
        """Name of the body that stands still: the carbody above a bogie."""
        return "ground" if max(self.levels.values(), default=0) > 1 else "carbody, fixed"

    def extent(self, name: str) -> tuple[float, float]:
        """Return the drawn ends of a body along the vehicle [m]: of all wheelsets and elements below it."""
        structure, below = self.structure, self.bodies_below(name)
        found = [self.axis(self.x_of_member(structure.members[other])) for other in below]
        found += [self.axis(self.x_of_joint(j)) for j in structure.joints if name in j.ends and below & set(j.ends)]
        return min(found), max(found)

    def bodies_below(self, name: str) -> set[str]:
        """Return a body with everything that it is carried by, down to the wheelsets."""
        found: set[str] = {name}
        found |= {w.name for w in self.structure.wheelsets if w.carrier == name}
        for joint in self.structure.joints:
            for other in joint.ends:
                if name in joint.ends and other is not None and self.levels[other] < self.levels[name]:
                    found |= self.bodies_below(other)
        return found


def joint_key(joint: Joint) -> str:
    """Return the name of one joint of an element, such as `primary_3`."""
    return f"{joint.part.name}_{joint.number}" if joint.number else joint.part.name
