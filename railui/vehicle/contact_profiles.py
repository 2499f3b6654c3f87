"""Measured wheel and rail profiles of a design: the contact parameters and the smooth table that follow from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from railui.io.atomic import relative_path
from railui.vehicle.parameter import Parameter
from railui.vehicle.parameters import CONTACT, PROFILES, WHEELSET_CONTACT
from railui.vehicle.wheelset_profiles import PairFiles, Sides, WheelsetProfiles

if TYPE_CHECKING:
    from railui.contact.geometry import ContactGeometry

GROUP = "contact.profiles"
FILE_KEYS = ("wheel", "rail")
USE_PATH = f"{GROUP}.use"
USES = ("table", "linearised")
SHAPE_KIND = "profile_shape"
SHARED_KEYS = ("spin_creep", "flange_clearance")
PARAMETERS_BY_KEY = {p.key: p for p in PROFILES}
GROUP_KEYS = ("back_to_back", "diameter_difference", "sd")  # that a group of wheelsets may have of its own
ALWAYS_WRITTEN = ("gauge", "back_to_back")


class UndefinedContactError(ValueError):
    """The profiles do not give a contact parameter that the design leaves to them."""


@dataclass(frozen=True)
class ContactGroup:
    """Wheelsets with one set of contact parameters: paths of rolling radius and wheel load, numbers from 1."""

    radius: str
    wheel_load: str
    wheelsets: tuple[int, ...]


@dataclass(frozen=True)
class FollowingNumbers:
    """Numbers by path, entries of the effect profile_shape and warnings that follow from profiles."""

    values: Mapping[str, float]
    shapes: tuple[dict[str, Any], ...]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class ContactProfiles:
    """Wheel and rail profiles of a design.

    Their numbers, `contact.profiles.gauge` and others, are parameters of the design.

    Attributes
    ----------
    wheels : mapping of str to (Path, Path)
        Profiles of the right and the left wheel, of each contact group.
    rails : (Path, Path)
        Profiles of the right and the left rail.
    mirror_rail : bool
    use : str
        "table" for the effect profile_shape, or "linearised".
    groups : mapping of str to ContactGroup
    derived : frozenset of str
        Paths of the contact parameters that follow from the profiles; the design gives the others.
    has_given_table : bool
        The design lists the effect profile_shape itself.
    sha256 : tuple of str or None
        Hashes of all files; None if a file is missing, so that only the numbers in the design are used.
    """

    wheels: Mapping[str, Sides]
    rails: Sides
    mirror_rail: bool
    use: str
    groups: Mapping[str, ContactGroup]
    derived: frozenset[str] = frozenset()
    has_given_table: bool = False
    sha256: tuple[str, ...] | None = None

    @property
    def wheel(self) -> Path:
        """Profile of the first right wheel."""
        return next(iter(self.wheels.values()))[0]

    @property
    def rail(self) -> Path:
        """Profile of the right rail."""
        return self.rails[0]

    @property
    def has_derived_table(self) -> bool:
        """True if the effect profile_shape follows from the profiles."""
        return self.use == USES[0] and not self.has_given_table

    @property
    def is_followed(self) -> bool:
        """True if any number of the design follows from the profiles."""
        return bool(self.derived) or self.has_derived_table

    def detached(self) -> ContactProfiles:
        """Return the profiles of a design that gives all contact parameters and its table itself."""
        return replace(self, derived=frozenset(), has_given_table=True)

    def parameter(self, path: str) -> Parameter | None:
        """Return the record of a number of the profiles, also of one group; None if there is no such number."""
        rest = path.removeprefix(f"{GROUP}.")
        group, _, key = rest.rpartition(".")
        if rest == path or key not in PARAMETERS_BY_KEY or (group and not self._has(group, key)):
            return None
        return replace(PARAMETERS_BY_KEY[key], path=path)

    def is_file_key(self, path: str) -> bool:
        """Return True for the key of a file of the profiles, such as contact.profiles.wheel, or of its reading."""
        keys = [f"{GROUP}.{key}" for key in (*FILE_KEYS, "mirror_rail")]
        keys += [f"{GROUP}.{group}.wheel" for group in self.groups]
        return any(path == key or path in (f"{key}.left", f"{key}.right") for key in keys)

    def _has(self, group: str, key: str) -> bool:
        return group in self.groups and key in GROUP_KEYS

    def number(self, values: Mapping[str, float], path: str) -> float:
        """Return a number of the profiles; that of all wheelsets if a group has none of its own."""
        return values[path] if path in values else values[f"{GROUP}.{path.rpartition('.')[2]}"]

    def of_group(self, values: Mapping[str, float], group: str) -> WheelsetProfiles:
        """Return the profiles of a contact group with the numbers of a design."""
        site = self.groups[group]
        number = {key: self.number(values, f"{GROUP}.{group}.{key}") for key in PARAMETERS_BY_KEY}
        pair = PairFiles(
            wheels=self.wheels[group],
            rails=self.rails,
            mirror_rail=self.mirror_rail,
            radius=values[site.radius],
            **{k: number[k] for k in ("smoothing", "gauge", "back_to_back", "inclination", "diameter_difference")},
        )
        return WheelsetProfiles(pair, values[site.wheel_load], number["sd"], number["surface"])

    def inputs(self, values: Mapping[str, float]) -> dict[str, WheelsetProfiles]:
        """Return the profiles of every contact group with the numbers of a design."""
        return {group: self.of_group(values, group) for group in self.groups}

    def input_paths(self) -> set[str]:
        """Return the paths of the numbers of a design that its contact parameters follow."""
        numbers = {f"{GROUP}.{key}" for key in PARAMETERS_BY_KEY}
        numbers |= {f"{GROUP}.{group}.{key}" for group in self.groups for key in GROUP_KEYS}
        return numbers | {path for site in self.groups.values() for path in (site.radius, site.wheel_load)}

    def geometry(self, values: Mapping[str, float]) -> ContactGeometry:
        """Return the contact geometry of the first wheelset with the numbers of a design.

        Raises
        ------
        OSError, FileProblems, ProfileError
            If a file cannot be read or the profiles do not touch.
        """
        return self.of_group(values, next(iter(self.groups))).geometry()

    def follow(self, values: Mapping[str, float]) -> FollowingNumbers:
        """Return the contact parameters and the table that follow from the numbers of a design.

        Raises
        ------
        OSError, FileProblems, ProfileError, UndefinedContactError, ValueError
            If a file cannot be read, the profiles do not touch, or give no number that the design lacks.
        """
        inputs = self.inputs(values)
        is_linearised = self.use == USES[1]
        each = {group: one.contact_parameters(is_linearised=is_linearised) for group, one in inputs.items()}
        warnings = [note for _, notes in each.values() for note in notes]
        numbers: dict[str, float] = {}
        for group, (found, _) in each.items():
            for p in WHEELSET_CONTACT:
                self._add(numbers, replace(p, path=f"contact.{group}.{p.key}"), found.get(p.key), inputs[group])
        for p in CONTACT:
            if p.key in SHARED_KEYS:
                shared = [found[p.key] for found, _ in each.values() if p.key in found]
                self._add(numbers, p, _mean(shared), next(iter(inputs.values())))
        shapes = self._shapes(inputs, values) if self.has_derived_table else ()
        return FollowingNumbers(numbers, shapes, tuple(dict.fromkeys(warnings)))

    def _add(self, to: dict[str, float], p: Parameter, value: float | None, of: WheelsetProfiles) -> None:
        """Add a number that the design leaves to its profiles: theirs, or its default."""
        if p.path not in self.derived:
            return
        number = p.default if value is None else value
        if number is None:
            raise UndefinedContactError(
                f"gives no {p.path} at a wheel load of {of.wheel_load:.4g} N and an sd of {of.sd:.3g} m"
            )
        to[p.path] = number

    def _shapes(
        self, inputs: Mapping[str, WheelsetProfiles], values: Mapping[str, float]
    ) -> tuple[dict[str, Any], ...]:
        """Return one effect for all wheelsets, or one for each if their profiles may differ."""
        shapes = {group: one.shape() for group, one in inputs.items()}
        has_own_numbers = any(f"{GROUP}.{group}.{key}" in values for group in self.groups for key in GROUP_KEYS)
        sources = {(self.wheels[group], site.radius) for group, site in self.groups.items()}
        if len(sources) == 1 and not has_own_numbers:
            return (_shape_entry(next(iter(shapes.values()))),)
        placed = [(i, shapes[group]) for group, site in self.groups.items() for i in site.wheelsets]
        return tuple(_shape_entry(shape, i) for i, shape in sorted(placed, key=lambda each: each[0]))

    def entry(self, directory: Path | None, kinds: Iterable[str], values: Mapping[str, float]) -> dict[str, Any]:
        """Return the keys of `contact.profiles` for a design file.

        Parameters
        ----------
        directory : Path or None
            Directory of the design file; None for absolute paths.
        kinds : iterable of str
            Kinds of the design's effects; `use` is table if they include profile_shape.
        values : mapping
            Numbers of the design.
        """
        written = {p.key: values[p.path] for p in PROFILES if values[p.path] != p.default or p.key in ALWAYS_WRITTEN}
        words: dict[str, Any] = {"mirror_rail": True} if self.mirror_rail else {}
        words |= {"use": self.present_use(kinds)}
        files = self.files(directory)
        groups: dict[str, dict[str, Any]] = {}
        for group in self.groups:
            paths = {key: f"{GROUP}.{group}.{key}" for key in GROUP_KEYS}
            own: dict[str, Any] = {key: values[path] for key, path in paths.items() if path in values}
            own |= {k.rpartition(".")[2]: v for k, v in files.items() if k.startswith(f"{group}.")}
            groups |= {group: own} if own else {}
        return written | {k: v for k, v in files.items() if "." not in k} | words | groups

    @staticmethod
    def present_use(kinds: Iterable[str]) -> str:
        """Return the use of the profiles of a design with effects of these kinds."""
        return USES[0] if SHAPE_KIND in kinds else USES[1]

    def files(self, directory: Path | None) -> dict[str, Any]:
        """Return the files by key of `contact.profiles`, relative to a directory, or absolute for None."""
        common = next(iter(self.wheels.values()))
        own = {f"{group}.wheel": wheels for group, wheels in self.wheels.items() if wheels != common}
        return {
            key: _sides_text(sides, directory) for key, sides in ({"wheel": common, "rail": self.rails} | own).items()
        }


def _mean(values: list[float]) -> float | None:
    """Return the mean; the value itself if all are equal."""
    if not values:
        return None
    return values[0] if len(set(values)) == 1 else sum(values) / len(values)


def _shape_entry(shape: Mapping[str, tuple[float, ...]], wheelset: int | None = None) -> dict[str, Any]:
    place = {} if wheelset is None else {"wheelset": wheelset}
    return {"kind": SHAPE_KIND, "at": "contact", **place, **{key: list(x) for key, x in shape.items()}}


def _sides_text(sides: Sides, directory: Path | None) -> Any:
    right, left = (p.as_posix() if directory is None else relative_path(p, directory) for p in sides)
    return right if right == left else {"left": left, "right": right}
