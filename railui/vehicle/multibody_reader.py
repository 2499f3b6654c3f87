"""Reading multibody vehicles: parts, numbers and topology."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

from railui.io.fields import Group, check_group
from railui.io.problems import Findings, suggest_name
from railui.io.units import UnitError
from railui.io.yaml_nodes import join_path
from railui.vehicle.division import POSITION_KEYS, divide_numbers, divisible_numbers
from railui.vehicle.element_kinds import (
    BODY,
    DIRECTED_KINDS,
    DIRECTIONS,
    ELEMENT_KINDS,
    GROUND,
    OMISSIBLE_KEYS,
    POSITION,
    parameters_of_kind,
)
from railui.vehicle.multibody import Structure
from railui.vehicle.multibody_checks import check_structure
from railui.vehicle.multibody_parts import Part
from railui.vehicle.parameter import Parameter, numbered_path
from railui.vehicle.parameters import CONTACT, WHEELSET_CONTACT

WORDS = {"wheelset": ("under", "contact"), "floor": ("body",), "body": ()}
SIDES = ("both", "right", "left")


@dataclass
class _PartReader:
    """Reader of parts, which collects values by path, and lists of values that differ between joints."""

    findings: Findings
    values: dict[str, float] = field(default_factory=dict)
    lists: dict[str, list[float]] = field(default_factory=dict)

    def part(self, group: str, name: str, raw: Mapping[str, Any], kind: str, known: tuple[Parameter, ...]) -> Part:
        """Read a body, element or floor point; add its numbers to `values`."""
        path = f"{group}.{name}"
        words = self._read_words(path, raw, kind)
        numbers = {key: value for key, value in raw.items() if key != "kind" and key not in word_keys(kind)}
        if group == "vehicle.elements" and kind != "wheelset":
            numbers = self.without_lists(path, numbers, [p for p in known if p.path not in POSITION_KEYS])
        model = check_group(group_model(kind, known), numbers, self.findings, path, extra=word_keys(kind))
        keys = [p.path for p in known if p.path not in OMISSIBLE_KEYS or raw.get(p.path) is not None]
        part = Part(name, kind, group, tuple(keys), words)
        if model is not None:
            self.values |= {f"{path}.{key}": float(getattr(model, key)) for key in keys}
        return part

    def without_lists(self, path: str, raw: Mapping[str, Any], known: Iterable[Parameter]) -> dict[str, Any]:
        """Return the numbers of a group, in place of a list its first value; add the lists to `lists`."""
        numbers = dict(raw)
        for p in known:
            if isinstance(entries := raw.get(p.path), list):
                values = [self._list_value(f"{path}.{p.path}.{i}", p, entry) for i, entry in enumerate(entries)]
                valid = [value for value in values if value is not None]
                numbers[p.path] = valid[0] if valid else p.maximum
                if not entries:
                    self.findings.add(join_path(path, p.path), "is empty", "write one number")
                elif len(valid) == len(entries):
                    self.lists[f"{path}.{p.path}"] = valid
        return numbers

    def _list_value(self, path: str, p: Parameter, entry: Any) -> float | None:
        try:
            return p.read(entry)
        except UnitError as error:
            self.findings.add(path, error.message, error.remedy)
            return None

    def _read_words(self, path: str, raw: Mapping[str, Any], kind: str) -> dict[str, str | tuple[str, ...]]:
        words: dict[str, str | tuple[str, ...]] = {}
        for key in word_keys(kind):
            value = raw.get(key)
            if value is None:
                continue
            if key == "between":
                if not isinstance(value, list) or len(value) != 2 or not all(isinstance(end, str) for end in value):
                    self.findings.add(join_path(path, key), "is not a pair of bodies", "write [wheelset, frame]")
                else:
                    words[key] = tuple(value)
            elif not isinstance(value, str):
                self.findings.add(join_path(path, key), f"{value!r} is not a name", "write a word")
            elif key in ("direction", "side") and value not in (choices := DIRECTIONS if key == "direction" else SIDES):
                self.findings.add(join_path(path, key), f"{value!r} is not known here", suggest_name(value, choices))
            else:
                words[key] = value
        return words


def word_keys(kind: str) -> tuple[str, ...]:
    """Return the keys of a kind that are words, not numbers."""
    if kind in WORDS:
        return WORDS[kind]
    return (
        "between",
        *(("direction",) if kind in DIRECTED_KINDS else ()),
        *(("side",) if kind != "anti_roll_bar" else ()),
    )


@cache
def group_model(kind: str, known: tuple[Parameter, ...]) -> type[Group]:
    """Return the model of the numbers of a part."""
    from railui.vehicle.design_schema import number_group

    free = tuple(replace(p, default=None, optional=True) if p.path in OMISSIBLE_KEYS else p for p in known)
    return number_group(f"{kind}_numbers", free)


def read_structure(data: Mapping[str, Any], findings: Findings) -> tuple[Structure | None, dict[str, float]]:
    """Read the structure of a vehicle and all its numbers by path [SI]; problems join `findings`."""
    read = _PartReader(findings)
    vehicle = data["vehicle"]
    for key in vehicle:
        if key not in ("bodies", "elements", "floor"):
            remedy = "a vehicle of bodies and elements has `bodies`, `elements` and `floor`"
            findings.add(f"vehicle.{key}", "unknown key", remedy, key=True)
    bodies = tuple(
        read.part("vehicle.bodies", name, raw, "body", BODY)
        for name, raw in _named_groups(vehicle.get("bodies"), "vehicle.bodies", findings)
    )
    elements = tuple(
        part
        for name, raw in _named_groups(vehicle.get("elements"), "vehicle.elements", findings)
        if (part := _read_element(read, name, raw)) is not None
    )
    floor = tuple(
        read.part("vehicle.floor", name, raw, "floor", POSITION)
        for name, raw in _named_groups(vehicle.get("floor"), "vehicle.floor", findings)
    )
    contacts = _read_contacts(data.get("contact"), read)
    structure = Structure(bodies, elements, floor, contacts)
    check_structure(structure, read.values, findings)
    if not findings.errors():
        structure = _with_lists(structure, read)
    return (None if findings.errors() else structure), read.values


def _with_lists(structure: Structure, read: _PartReader) -> Structure:
    """Return the structure with the numbers that a file gives as lists; their values replace the common ones."""
    divisible = divisible_numbers(structure)
    for path, values in read.lists.items():
        numbers = divisible.get(path, ())
        what, name = ("wheelsets", "wheelset") if path.startswith("contact.") else ("joints", path.split(".")[2])
        if not numbers:
            remedy = "write one number, without brackets"
            read.findings.add(path, f"has a list, but acts at one of the {what} only", remedy)
        elif len(values) != len(numbers):
            names = ", ".join(f"{name} {n}" for n in numbers)
            remedy = f"write one number, or one each for {names}"
            read.findings.add(path, f"has {len(values)} numbers for {len(numbers)} {what}", remedy)
        else:
            del read.values[path]
            read.values |= {numbered_path(path, n): value for n, value in zip(numbers, values, strict=True)}
    return structure if read.findings.errors() else divide_numbers(structure, tuple(read.lists))


def check_no_lists(structure: Structure, findings: Findings) -> None:
    """Report contact parameters that differ between the wheelsets of a group whose profiles are given."""
    for path, _ in structure.divided:
        if path.startswith("contact."):
            remedy = "give every wheelset a contact group of its own"
            findings.add(path, "the wheelsets of a group with profiles have the same contact parameters", remedy)


def _named_groups(raw: Any, path: str, findings: Findings) -> Iterable[tuple[str, Mapping[str, Any]]]:
    if raw is None:
        return
    if not isinstance(raw, dict):
        findings.add(path, "is not a group of names", "write `name: {...}` lines below it")
        return
    for name, entry in raw.items():
        if not isinstance(entry, dict):
            findings.add(join_path(path, name), "is not a group of keys", "write `key: value` lines below it")
        elif "." in name or not name.isidentifier() or name == GROUND:
            findings.add(join_path(path, name), f"{name!r} is not a valid name", "use letters, digits and _", key=True)
        else:
            yield name, entry


def _read_element(read: _PartReader, name: str, raw: Mapping[str, Any]) -> Part | None:
    path, kind = f"vehicle.elements.{name}", raw.get("kind")
    if kind not in ELEMENT_KINDS:
        message = "has no kind" if kind is None else f"unknown kind {kind!r}"
        remedy = (
            f"add `kind:`, one of {', '.join(ELEMENT_KINDS)}"
            if kind is None
            else suggest_name(str(kind), ELEMENT_KINDS)
        )
        read.findings.add(path if kind is None else join_path(path, "kind"), message, remedy)
        return None
    direction = raw.get("direction", "lateral")
    known = parameters_of_kind(str(kind), direction if direction in DIRECTIONS else "lateral")
    part = read.part("vehicle.elements", name, raw, str(kind), known)
    if kind in ("spring", "damper") and not any(
        p.path in raw for p in known if p.path.endswith(("stiffness", "damping"))
    ):
        law = "stiffness" if kind == "spring" else "damping"
        keys = ", ".join(f"{way}_{law}" for way in DIRECTIONS)
        read.findings.add(path, f"has no {law}", f"add one of {keys}")
    if "between" not in part.words and kind != "wheelset" and "between" not in raw:
        read.findings.add(path, "joins no bodies", "add `between: [first, second]`, two bodies or `ground`")
    return part


def _read_contacts(raw: Any, read: _PartReader) -> tuple[str, ...]:
    """Read the contact groups and the numbers common to all wheelsets; return the names of the groups."""
    common = tuple(p for p in CONTACT if p.path.count(".") == 1)
    raw = {} if raw is None else raw
    if not isinstance(raw, dict):
        read.findings.add("contact", "is not a group of keys", "write `key: value` lines below it")
        return ()
    shared = {p.key: p for p in common}
    names = [key for key in raw if key not in shared and key != "gauge_widens_clearance"]
    for name in names:
        if not isinstance(raw[name], dict):
            known = [*shared, "gauge_widens_clearance"]
            read.findings.add(f"contact.{name}", "unknown key", suggest_name(name, known), key=True)
            continue
        numbers = read.without_lists(f"contact.{name}", raw[name], WHEELSET_CONTACT)
        model = check_group(group_model("contact", WHEELSET_CONTACT), numbers, read.findings, f"contact.{name}")
        if model is not None:
            read.values |= {f"contact.{name}.{p.path}": float(getattr(model, p.path)) for p in WHEELSET_CONTACT}
    here = tuple(replace(p, path=p.key) for p in common)
    given = {key: value for key, value in raw.items() if key in shared}
    model = check_group(group_model("contact_common", here), given, read.findings, "contact")
    if model is not None:
        read.values |= {f"contact.{p.path}": float(getattr(model, p.path)) for p in here}
    return tuple(name for name in names if isinstance(raw[name], dict))
