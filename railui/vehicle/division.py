"""Numbers that differ between the joints of an element or between the wheelsets of a contact group."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from railui.vehicle.design import Design
from railui.vehicle.element_kinds import POINT, SECOND_POINT
from railui.vehicle.multibody import Structure
from railui.vehicle.parameter import numbered_path
from railui.vehicle.parameters import WHEELSET_CONTACT

POSITION_KEYS = frozenset(p.path for p in (*POINT, *SECOND_POINT))
Number = TypeVar("Number")


def divisible_numbers(structure: Structure) -> dict[str, tuple[int, ...]]:
    """Return the numbers that several joints or wheelsets share or that already differ between them.

    Returns
    -------
    dict of tuple of int
        Numbers of the joints of the element, or of the wheelsets of the contact group, by path. Positions have none:
        elements at different places are elements of their own.
    """
    shared: dict[str, tuple[int, ...]] = {}
    for part in structure.elements:
        numbers = () if part.kind == "wheelset" else tuple(joint.number for joint in structure.joints_of(part))
        shared |= {part.number_path(key): numbers for key in part.keys if key not in POSITION_KEYS}
    for name in structure.contacts:
        numbers = tuple(w.number for w in structure.wheelsets if structure.contact_of(w) == name)
        shared |= {f"contact.{name}.{p.path}": numbers for p in WHEELSET_CONTACT}
    return {path: numbers for path, numbers in shared.items() if len(numbers) > 1}


def divide_numbers(structure: Structure, paths: Sequence[str]) -> Structure:
    """Return a structure whose numbers at these paths differ between joints or wheelsets; KeyError if one cannot."""
    numbers = divisible_numbers(structure)
    divided = structure.divided_numbers | {path: numbers[path] for path in paths}
    return replace(structure, divided=tuple(divided.items()))


def divide_design(design: Design, paths: Sequence[str]) -> Design:
    """Return a design with one number for each joint or wheelset at these paths, all equal to the common one.

    The parameters of an earlier campaign are those of the undivided design, so that its `adjustment` is left out.
    """
    assert design.structure is not None
    structure = design.structure
    new = [path for path in paths if path not in structure.divided_numbers]
    if not new:
        return design
    structure = divide_numbers(structure, new)
    return replace(
        design,
        structure=structure,
        values=_divided(design.values, structure),
        load_states={name: _divided(changes, structure) for name, changes in design.load_states.items()},
        unloaded_values=_divided(design.unloaded_values, structure),
        adjustment=None,
    )


def newly_divided(undivided: Design, design: Design) -> tuple[str, ...]:
    """Return the paths of the numbers that differ between joints or wheelsets of a design only, not of another."""
    if undivided.structure is None or design.structure is None:
        return ()
    return tuple(p for p in design.structure.divided_numbers if p not in undivided.structure.divided_numbers)


def _divided(values: Mapping[str, Number], structure: Structure) -> dict[str, Number]:
    return {each: value for path, value in values.items() for each in structure.paths_of(path)}


def joined_lists(values: Mapping[str, Number], structure: Structure) -> dict[str, Number | list[Number]]:
    """Return values by path, those that differ between joints as one list, as a file has them."""
    lists = {numbered_path(path, numbers[0]): (path, numbers) for path, numbers in structure.divided}
    others = {numbered_path(path, n) for path, numbers in structure.divided for n in numbers[1:]}
    joined: dict[str, Number | list[Number]] = {}
    for path, value in values.items():
        if path in lists:
            shared, numbers = lists[path]
            joined[shared] = [values[numbered_path(shared, n)] for n in numbers]
        elif path not in others:
            joined[path] = value
    return joined


def with_common_numbers(values: Mapping[str, float], structure: Structure) -> dict[str, float]:
    """Return values by path, with the mean of the joints or wheelsets at every path that they no longer share."""
    means = {
        path: sum(values[numbered_path(path, n)] for n in numbers) / len(numbers) for path, numbers in structure.divided
    }
    return {**values, **means}


def path_in_list(structure: Structure, path: str) -> str:
    """Return the path of a number in its file: the number of a joint replaced by its place in the list, from 0."""
    for shared, numbers in structure.divided:
        if path.startswith(f"{shared}."):
            return f"{shared}.{numbers.index(int(path.rpartition('.')[2]))}"
    return path
