"""Vehicles as bodies and elements: who is joined to whom, where effects may stand."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from railui.vehicle.element_kinds import BODY, GROUND, PLACED, TURNS, numbers_of
from railui.vehicle.parameters import CONTACT, WHEELSET_CONTACT, Parameter


@dataclass(frozen=True)
class Part:
    """A body, an element or a floor point as a file names it: its kind, its words, the numbers that it has."""

    name: str
    kind: str
    group: str
    keys: tuple[str, ...]
    words: Mapping[str, str | tuple[str, ...]] = field(default_factory=dict)

    def __hash__(self) -> int:
        return hash((self.name, self.kind, self.group, self.keys, tuple(sorted(map(str, self.words.items())))))

    @property
    def path(self) -> str:
        """Its dotted path, `vehicle.elements.primary`."""
        return f"{self.group}.{self.name}"

    def at(self, key: str) -> str:
        """The path of one of its numbers."""
        return f"{self.path}.{key}"

    def word(self, key: str, default: str = "") -> str:
        """One of its words."""
        return str(self.words.get(key, default))

    @property
    def between(self) -> tuple[str, str]:
        """The two names that it joins."""
        first, second = list(self.words["between"])
        return first, second

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The records of its numbers by their paths."""
        if self.kind == "body":
            known: tuple[Parameter, ...] = BODY
        elif self.kind == "floor":
            known = PLACED
        else:
            known = numbers_of(self.kind, self.word("direction", "lateral"))
        called = self.name.replace("_", " ")
        return tuple(
            replace(p, path=self.at(p.path), caption=f"{p.caption}, {called}") for p in known if p.path in self.keys
        )


@dataclass(frozen=True)
class Member:
    """One rigid body of the vehicle: a body, one of two like it, or a wheelset.

    `number` counts wheelsets from the front, and the two of a pair; 0 where it is alone. `under` names the body
    that a wheelset stands under, `side` is 1 in front, -1 behind.
    """

    name: str
    part: Part
    number: int = 0
    side: int = 0
    under: str | None = None

    @property
    def is_wheelset(self) -> bool:
        """Does it roll on the rails?"""
        return self.part.kind == "wheelset"

    def free(self, way: str) -> bool:
        """Does it yaw, does it roll?"""
        return f"{way}_inertia" in self.part.keys

    @property
    def degrees(self) -> int:
        """Degrees of freedom: sideways, and the turns that have an inertia."""
        return 1 + self.free("yaw") + self.free("roll")


@dataclass(frozen=True)
class Joined:
    """An element between two members (None: the ground); `number` tells it from those of the same element."""

    part: Part
    ends: tuple[str | None, str | None]
    number: int


@dataclass(frozen=True)
class Place:
    """A place where effects may stand: the place of the catalogue that it is like, and its numbers (0: only one)."""

    at: str
    like: str
    numbers: tuple[int, ...]


@dataclass(frozen=True)
class Structure:
    """Who is joined to whom: everything of a vehicle of bodies and elements that is not a number."""

    bodies: tuple[Part, ...]
    elements: tuple[Part, ...]
    floor: tuple[Part, ...]
    contacts: tuple[str, ...]

    @cached_property
    def parameters(self) -> dict[str, Parameter]:
        """The records of all its numbers by path, in their order."""
        parts = (*self.bodies, *self.elements, *self.floor)
        found = {p.path: p for part in parts for p in part.parameters}
        for name in self.contacts:
            for p in WHEELSET_CONTACT:
                called = f"{p.caption}, {name.replace('_', ' ')}"
                found[f"contact.{name}.{p.path}"] = replace(p, path=f"contact.{name}.{p.path}", caption=called)
        return found | {p.path: p for p in CONTACT if p.path.count(".") == 1}

    @cached_property
    def members(self) -> dict[str, Member]:
        """Every rigid body by its name: bodies in their order, then wheelsets from the front."""
        found: dict[str, Member] = {}
        for part in self.bodies:
            for member in _pair(part, "half_centres"):
                found[member.name] = member
        number = 0
        for part in self.wheelset_parts:
            carried = self._under(part, found)
            pair = carried is not None and "half_wheelbase" in part.keys
            several = pair or (carried is not None and len(carried) > 1)
            for under in carried if carried is not None else [None]:
                for side in (1, -1) if pair else (0,):
                    number += 1
                    name = f"{part.name}_{self._count(found, part) + 1}" if several else part.name
                    found[name] = Member(name, part, number, side, under)
        return found

    @staticmethod
    def _count(found: Mapping[str, Member], part: Part) -> int:
        return sum(member.part is part for member in found.values())

    def _under(self, part: Part, found: Mapping[str, Member]) -> list[str | None] | None:
        under = part.word("under")
        if not under:
            return None
        return [m.name for m in found.values() if not m.is_wheelset and under in (m.name, m.part.name)]

    @property
    def wheelset_parts(self) -> tuple[Part, ...]:
        """The elements that are wheelsets, each of which may stand for several."""
        return tuple(part for part in self.elements if part.kind == "wheelset")

    @cached_property
    def wheelsets(self) -> tuple[Member, ...]:
        """The wheelsets from the front."""
        return tuple(m for m in self.members.values() if m.is_wheelset)

    def of(self, name: str) -> list[Member]:
        """The members that a name stands for: one, or all of a pair or family."""
        return [m for m in self.members.values() if name in (m.name, m.part.name)]

    @cached_property
    def joints(self) -> tuple[Joined, ...]:
        """Every element at every place where it joins two members."""
        return tuple(joint for part in self.elements if part.kind != "wheelset" for joint in self.joints_of(part))

    def joints_of(self, part: Part) -> list[Joined]:
        """The places of one element; ValueError where its two ends do not go together."""
        first, second = part.between
        ends = list(self._ends(first, second))
        return [Joined(part, (a, b), self._numbered(a, b, i, len(ends))) for i, (a, b) in enumerate(ends)]

    def _numbered(self, a: str | None, b: str | None, i: int, count: int) -> int:
        wheels = [self.members[end].number for end in (a, b) if end is not None and self.members[end].is_wheelset]
        return wheels[0] if len(wheels) == 1 else i + 1 if count > 1 else 0

    def _ends(self, first: str, second: str) -> Iterator[tuple[str | None, str | None]]:
        a, b = ([m.name for m in self.of(name)] if name != GROUND else [None] for name in (first, second))
        for these, those, turned in ((a, b, False), (b, a, True)):
            under = [self.members[name].under if name is not None else None for name in these]
            if under and all(home is not None and home in those for home in under):
                pairs = zip(these, under, strict=True)
                yield from ((home, name) if turned else (name, home) for name, home in pairs)
                return
        if len(a) == len(b):
            yield from zip(a, b, strict=True)
        elif len(a) == 1 or len(b) == 1:
            yield from ((x, y) for x in a for y in b)
        else:
            raise ValueError(f"{len(a)} of {first} and {len(b)} of {second} do not go together")

    def contact_of(self, wheelset: Member) -> str:
        """The contact group of a wheelset: named, of its own name, leading or trailing by its side, or the only one.

        Empty where none of them is there.
        """
        if named := wheelset.part.word("contact"):
            return named
        side = {1: "leading", -1: "trailing"}.get(wheelset.side, "")
        own = [name for name in (wheelset.name, wheelset.part.name, side) if name in self.contacts]
        return own[0] if own else self.contacts[0] if len(self.contacts) == 1 else ""

    def rolls(self, joint: Joined) -> bool:
        """Does a body at either end roll?"""
        return any(end is not None and self.members[end].free("roll") for end in joint.ends)

    @cached_property
    def places(self) -> dict[str, Place]:
        """Where effects may stand."""
        found: dict[str, Place] = {}

        def add(at: str, like: str, number: int) -> None:
            numbers = found[at].numbers if at in found else ()
            found[at] = Place(at, like, (*numbers, number) if number not in numbers else numbers)

        for joint in self.joints:
            wheeled = any(end is not None and self.members[end].is_wheelset for end in joint.ends)
            kind = "primary" if wheeled else "secondary"
            if joint.part.kind == "link":
                add(joint.part.name, f"{kind}_lateral", joint.number)
                continue
            add(f"{joint.part.name}_lateral", f"{kind}_lateral", joint.number)
            add(f"{joint.part.name}_yaw", f"{kind}_yaw", joint.number)
            if self.rolls(joint):
                add(f"{joint.part.name}_roll", f"{kind}_yaw", joint.number)
        for member in self.members.values():
            name, like = ("wheelset",) * 2 if member.is_wheelset else (member.part.name, "frame")
            add(name, like, member.number)
            for way in TURNS:
                if member.free(way):
                    add(f"{name}_{way}", f"{like}_yaw", member.number)
        wheelsets = tuple(w.number for w in self.wheelsets)
        return found | {at: Place(at, at, wheelsets) for at in ("contact", "track")}

    def sites(self, values: Mapping[str, float]) -> dict[str, float]:
        """The linear stiffness and damping at each place: site.PLACE.stiffness, site.PLACE.damping."""
        found = {"site.rolling_radius": values.get(self.wheelsets[0].part.at("rolling_radius"), 0.0)}
        for part in self.elements:
            if part.kind not in ("spring", "damper", "anti_roll_bar", "link"):
                continue
            sides = 2.0 if self.mirrored(part) else 1.0

            def get(key: str, part: Part = part) -> float:
                return values.get(part.at(key), 0.0)

            arm = get("y") ** 2
            for law in ("stiffness", "damping"):
                told = {
                    "_lateral": get(f"lateral_{law}"),
                    "_yaw": get(f"yaw_{law}") + get(f"longitudinal_{law}") * arm,
                    "_roll": get(f"roll_{law}") + get(f"vertical_{law}") * arm,
                }
                if part.kind == "anti_roll_bar":
                    told = {"_roll": get(law)}
                elif part.kind == "link":
                    told = {"": get(law)}
                found |= {f"site.{part.name}{end}.{law}": sides * value for end, value in told.items()}
        return found

    def words(self) -> dict[str, dict[str, dict[str, object]]]:
        """Kinds and words of every part, by group and name: what is not a number."""
        found: dict[str, dict[str, dict[str, object]]] = {}
        for part in (*self.bodies, *self.elements, *self.floor):
            told: dict[str, object] = {"kind": part.kind} if part.kind not in ("body", "floor") else {}
            told |= {key: list(word) if isinstance(word, tuple) else word for key, word in part.words.items()}
            found.setdefault(part.group.rpartition(".")[2], {})[part.name] = told
        return found

    @staticmethod
    def mirrored(part: Part) -> bool:
        """Does it stand on both sides of the vehicle?"""
        return "y" in part.keys and part.word("side", "both") == "both"


def _pair(part: Part, half: str) -> list[Member]:
    if half not in part.keys:
        return [Member(part.name, part)]
    return [Member(f"{part.name}_{i}", part, i, side) for i, side in ((1, 1), (2, -1))]
