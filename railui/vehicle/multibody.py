"""Topology of multibody vehicles: rigid bodies, joints and locations of effects."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from railui.vehicle.element_kinds import GROUND, ROTATIONS
from railui.vehicle.multibody_parts import EffectLocation, Joint, Member, Part
from railui.vehicle.parameter import Parameter, numbered_path
from railui.vehicle.parameters import CONTACT, WHEELSET_CONTACT
from railui.vehicle.sensors import Sensor, kernel_names


@dataclass(frozen=True)
class Structure:
    """Topology of a multibody vehicle: everything but its numbers.

    Attributes
    ----------
    bodies, elements, floor : tuple of Part
    contacts : tuple of str
        Names of the contact groups.
    sensors : tuple of Sensor
        Those that a campaign declares.
    divided : tuple of (str, tuple of int)
        Paths of the numbers that differ between joints or wheelsets, with the numbers of these.
    """

    bodies: tuple[Part, ...]
    elements: tuple[Part, ...]
    floor: tuple[Part, ...]
    contacts: tuple[str, ...]
    sensors: tuple[Sensor, ...] = ()
    divided: tuple[tuple[str, tuple[int, ...]], ...] = ()

    @cached_property
    def parameters(self) -> dict[str, Parameter]:
        """Parameter records of all numbers by path, in the order of the kernel."""
        parts = (*self.bodies, *self.elements, *self.floor)
        shared = [p for part in parts for p in part.parameters]
        for name in self.contacts:
            called = name.replace("_", " ")
            shared += [
                replace(p, path=f"contact.{name}.{p.path}", caption=f"{p.caption}, {called}") for p in WHEELSET_CONTACT
            ]
        shared += [p for p in CONTACT if p.path.count(".") == 1]
        return {each.path: each for p in shared for each in self._divide(p)}

    @cached_property
    def divided_numbers(self) -> dict[str, tuple[int, ...]]:
        """Numbers of the joints or wheelsets by the path of what differs between them."""
        return dict(self.divided)

    def _divide(self, p: Parameter) -> list[Parameter]:
        numbers = self.divided_numbers.get(p.path)
        if numbers is None:
            return [p]
        return [replace(p, path=numbered_path(p.path, n), caption=f"{p.caption} {n}") for n in numbers]

    def paths_of(self, path: str) -> tuple[str, ...]:
        """Return the path of a number, or those of its joints or wheelsets where it differs between them."""
        numbers = self.divided_numbers.get(path)
        return (path,) if numbers is None else tuple(numbered_path(path, n) for n in numbers)

    def path_at(self, path: str, number: int) -> str:
        """Return the path of a number of one joint or wheelset."""
        return numbered_path(path, number) if path in self.divided_numbers else path

    @cached_property
    def channel_names(self) -> dict[str, str]:
        """The kernel's channel of every sensor whose channel is called otherwise in the runs."""
        return kernel_names(self)

    @cached_property
    def members(self) -> dict[str, Member]:
        """Every rigid body by name: bodies in the order of the file, then wheelsets from the front."""
        members: dict[str, Member] = {}
        for part in self.bodies:
            for member in _members_of_body(part, "half_centres"):
                members[member.name] = member
        number = 0
        for part in self.wheelset_parts:
            carriers = self._carriers(part, members)
            is_pair = carriers is not None and "half_wheelbase" in part.keys
            has_several = is_pair or (carriers is not None and len(carriers) > 1)
            for carrier in carriers if carriers is not None else [None]:
                for side in (1, -1) if is_pair else (0,):
                    number += 1
                    name = f"{part.name}_{self._count_members(members, part) + 1}" if has_several else part.name
                    members[name] = Member(name, part, number, side, carrier)
        return members

    @staticmethod
    def _count_members(members: Mapping[str, Member], part: Part) -> int:
        return sum(member.part is part for member in members.values())

    def _carriers(self, part: Part, members: Mapping[str, Member]) -> list[str | None] | None:
        carrier = part.word("under")
        if not carrier:
            return None
        return [m.name for m in members.values() if not m.is_wheelset and carrier in (m.name, m.part.name)]

    @property
    def wheelset_parts(self) -> tuple[Part, ...]:
        """Elements of kind wheelset, each of which may describe several wheelsets."""
        return tuple(part for part in self.elements if part.kind == "wheelset")

    @cached_property
    def wheelsets(self) -> tuple[Member, ...]:
        """Wheelsets from the front."""
        return tuple(m for m in self.members.values() if m.is_wheelset)

    def members_named(self, name: str) -> list[Member]:
        """Return the members with a name: a single one, or all members of a part."""
        return [m for m in self.members.values() if name in (m.name, m.part.name)]

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """Every pair of members joined by an element."""
        return tuple(joint for part in self.elements if part.kind != "wheelset" for joint in self.joints_of(part))

    def joints_of(self, part: Part) -> list[Joint]:
        """Return the joints of an element; ValueError if its two ends cannot be paired."""
        first, second = part.between
        ends = list(self._paired_ends(first, second))
        return [Joint(part, (a, b), self._joint_number(a, b, i, len(ends))) for i, (a, b) in enumerate(ends)]

    def _joint_number(self, a: str | None, b: str | None, i: int, count: int) -> int:
        wheels = [self.members[end].number for end in (a, b) if end is not None and self.members[end].is_wheelset]
        return wheels[0] if len(wheels) == 1 else i + 1 if count > 1 else 0

    def _paired_ends(self, first: str, second: str) -> Iterator[tuple[str | None, str | None]]:
        a, b = ([m.name for m in self.members_named(name)] if name != GROUND else [None] for name in (first, second))
        for names, others, is_swapped in ((a, b, False), (b, a, True)):
            carriers = [self.members[name].carrier if name is not None else None for name in names]
            if carriers and all(carrier is not None and carrier in others for carrier in carriers):
                pairs = zip(names, carriers, strict=True)
                yield from ((carrier, name) if is_swapped else (name, carrier) for name, carrier in pairs)
                return
        if len(a) == len(b):
            yield from zip(a, b, strict=True)
        elif len(a) == 1 or len(b) == 1:
            yield from ((x, y) for x in a for y in b)
        else:
            raise ValueError(f"{len(a)} of {first} and {len(b)} of {second} do not go together")

    def contact_of(self, wheelset: Member) -> str:
        """Return the contact group of a wheelset; empty if there is none.

        In order of precedence: the group that it names, the group of its name, leading or trailing by its side, the
        only group.
        """
        if named := wheelset.part.word("contact"):
            return named
        side = {1: "leading", -1: "trailing"}.get(wheelset.side, "")
        names = [name for name in (wheelset.name, wheelset.part.name, side) if name in self.contacts]
        return names[0] if names else self.contacts[0] if len(self.contacts) == 1 else ""

    def joins_rolling_body(self, joint: Joint) -> bool:
        """True if a body at either end may roll."""
        return any(end is not None and self.members[end].has_rotation("roll") for end in joint.ends)

    @cached_property
    def effect_locations(self) -> dict[str, EffectLocation]:
        """Locations of effects by name."""
        locations: dict[str, EffectLocation] = {}

        def add(at: str, catalogue_name: str, number: int) -> None:
            numbers = locations[at].numbers if at in locations else ()
            locations[at] = EffectLocation(at, catalogue_name, (*numbers, number) if number not in numbers else numbers)

        for joint in self.joints:
            wheeled = any(end is not None and self.members[end].is_wheelset for end in joint.ends)
            kind = "primary" if wheeled else "secondary"
            if joint.part.kind == "link":
                add(joint.part.name, f"{kind}_lateral", joint.number)
                continue
            add(f"{joint.part.name}_lateral", f"{kind}_lateral", joint.number)
            add(f"{joint.part.name}_yaw", f"{kind}_yaw", joint.number)
            if self.joins_rolling_body(joint):
                add(f"{joint.part.name}_roll", f"{kind}_yaw", joint.number)
        for member in self.members.values():
            name, catalogue_name = ("wheelset",) * 2 if member.is_wheelset else (member.part.name, "frame")
            add(name, catalogue_name, member.number)
            for way in ROTATIONS:
                if member.has_rotation(way):
                    add(f"{name}_{way}", f"{catalogue_name}_yaw", member.number)
        wheelsets = tuple(w.number for w in self.wheelsets)
        return locations | {at: EffectLocation(at, at, wheelsets) for at in ("contact", "track")}

    def site_values(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return linear stiffness and damping of each location as site.LOCATION.stiffness and .damping."""
        sites = {"site.rolling_radius": values.get(self.wheelsets[0].part.number_path("rolling_radius"), 0.0)}
        for part in self.elements:
            if part.kind not in ("spring", "damper", "anti_roll_bar", "link"):
                continue
            sides = 2.0 if self.is_mirrored(part) else 1.0

            def get(key: str, part: Part = part) -> float:
                paths = self.paths_of(part.number_path(key))
                return sum(values.get(path, 0.0) for path in paths) / len(paths)

            arm = get("y") ** 2
            for law in ("stiffness", "damping"):
                sums = {
                    "_lateral": get(f"lateral_{law}"),
                    "_yaw": get(f"yaw_{law}") + get(f"longitudinal_{law}") * arm,
                    "_roll": get(f"roll_{law}") + get(f"vertical_{law}") * arm,
                }
                if part.kind == "anti_roll_bar":
                    sums = {"_roll": get(law)}
                elif part.kind == "link":
                    sums = {"": get(law)}
                sites |= {f"site.{part.name}{end}.{law}": sides * value for end, value in sums.items()}
        return sites

    def words(self) -> dict[str, dict[str, dict[str, object]]]:
        """Return the kind and the words of every part, by group and name."""
        groups: dict[str, dict[str, dict[str, object]]] = {}
        for part in (*self.bodies, *self.elements, *self.floor):
            words: dict[str, object] = {"kind": part.kind} if part.kind not in ("body", "floor") else {}
            words |= {key: list(word) if isinstance(word, tuple) else word for key, word in part.words.items()}
            groups.setdefault(part.group.rpartition(".")[2], {})[part.name] = words
        return groups

    @staticmethod
    def is_mirrored(part: Part) -> bool:
        """True if the element is on both sides of the vehicle."""
        return "y" in part.keys and part.word("side", "both") == "both"


def _members_of_body(part: Part, half: str) -> list[Member]:
    if half not in part.keys:
        return [Member(part.name, part)]
    return [Member(f"{part.name}_{i}", part, i, side) for i, side in ((1, 1), (2, -1))]


def position(structure: Structure, member: Member, values: Mapping[str, float]) -> float:
    """Return the longitudinal position x of a member [m], positive forwards."""
    return sum(factor * values[path] for factor, path in position_terms(structure, member))


def position_terms(structure: Structure, member: Member) -> list[tuple[float, str]]:
    """Return the position x of a member as a sum of (factor, path of a number)."""
    part = member.part
    terms: list[tuple[float, str]] = []
    if member.carrier is not None:
        terms += position_terms(structure, structure.members[member.carrier])
    for key in ("half_centres", "half_wheelbase"):
        if key in part.keys:
            terms.append((float(member.side), part.number_path(key)))
    if "x" in part.keys:
        terms.append((1.0, part.number_path("x")))
    return terms


def bogie_masses(structure: Structure, values: Mapping[str, float]) -> list[float]:
    """Return the mass of each bogie [kg], its frame and the wheelsets under it.

    A bogie frame is a body with wheelsets `under` it that an element joins to another body: not that of a wagon whose
    wheelsets are under the carbody.
    """
    to_others = {None, *(w.name for w in structure.wheelsets)}
    joined = {end for joint in structure.joints if not to_others & {*joint.ends} for end in joint.ends}
    frames = sorted(w for w in {w.carrier for w in structure.wheelsets} & joined if w is not None)

    def mass(member: Member) -> float:
        return values[structure.path_at(member.part.number_path("mass"), member.number)]

    members = structure.members.values()
    return [sum(mass(m) for m in members if frame in (m.name, m.carrier)) for frame in frames]
