"""Parts of multibody vehicles: bodies, elements, joints and locations of effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from railui.vehicle.element_kinds import BODY, POSITION, parameters_of_kind
from railui.vehicle.parameter import Parameter


@dataclass(frozen=True)
class Part:
    """Body, element or floor point of a design file: kind, words and keys of its numbers."""

    name: str
    kind: str
    group: str
    keys: tuple[str, ...]
    words: Mapping[str, str | tuple[str, ...]] = field(default_factory=dict)

    def __hash__(self) -> int:
        return hash((self.name, self.kind, self.group, self.keys, tuple(sorted(map(str, self.words.items())))))

    @property
    def path(self) -> str:
        """Dotted path, such as `vehicle.elements.primary`."""
        return f"{self.group}.{self.name}"

    def number_path(self, key: str) -> str:
        """Return the path of a number of this part."""
        return f"{self.path}.{key}"

    def word(self, key: str, default: str = "") -> str:
        """Return a word of this part."""
        return str(self.words.get(key, default))

    @property
    def between(self) -> tuple[str, str]:
        """Names of the two bodies that the element joins."""
        first, second = list(self.words["between"])
        return first, second

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameter records of its numbers, with full paths."""
        if self.kind == "body":
            known: tuple[Parameter, ...] = BODY
        elif self.kind == "floor":
            known = POSITION
        else:
            known = parameters_of_kind(self.kind, self.word("direction", "lateral"))
        called = self.name.replace("_", " ")
        return tuple(
            replace(p, path=self.number_path(p.path), caption=f"{p.caption}, {called}")
            for p in known
            if p.path in self.keys
        )


@dataclass(frozen=True)
class Member:
    """Rigid body of the vehicle: a body, one of a pair of bodies, or a wheelset.

    Attributes
    ----------
    name : str
    part : Part
    number : int
        Counts wheelsets from the front and the bodies of a pair from 1; 0 for a single body.
    side : int
        1 in front of the centre of a pair, -1 behind it, 0 for a single one.
    carrier : str or None
        Body above a wheelset.
    """

    name: str
    part: Part
    number: int = 0
    side: int = 0
    carrier: str | None = None

    @property
    def is_wheelset(self) -> bool:
        """True for a wheelset."""
        return self.part.kind == "wheelset"

    @property
    def is_on_rollers(self) -> bool:
        """True for a wheelset on the rollers of a rig."""
        return "roller_radius" in self.part.keys

    def has_rotation(self, way: str) -> bool:
        """True if the body may yaw or roll, that is, has an inertia for it."""
        return f"{way}_inertia" in self.part.keys

    @property
    def dof_count(self) -> int:
        """Number of degrees of freedom: lateral, and the rotations that have an inertia."""
        return 1 + self.has_rotation("yaw") + self.has_rotation("roll")


@dataclass(frozen=True)
class Joint:
    """Element between two members (None is the ground); `number` counts the joints of one element."""

    part: Part
    ends: tuple[str | None, str | None]
    number: int

    @property
    def locations(self) -> tuple[str, ...]:
        """Names of the locations of effects that it may have: along a link, else in the directions of its element."""
        name = self.part.name
        return (name,) if self.part.kind == "link" else tuple(f"{name}_{way}" for way in ("lateral", "yaw", "roll"))


@dataclass(frozen=True)
class EffectLocation:
    """Location of effects: its name, the equivalent location in the catalogue, its numbers (0 if there is one)."""

    name: str
    catalogue_name: str
    numbers: tuple[int, ...]
