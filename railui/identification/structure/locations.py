"""Locations of effects, forces and force curves on a vehicle."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Final

from railui import core
from railui.vehicle.effects import WHEELSET_LOCATIONS
from railui.vehicle.model import Model
from railui.vehicle.multibody import Structure

JOINT_CLASSES: Final = ("primary_lateral", "primary_yaw", "secondary_lateral", "secondary_yaw")
# directions of the numbers of an element, and of the locations at which it acts
DIRECTION_OF_WAY: Final = {
    "lateral": "lateral",
    "longitudinal": "yaw",
    "yaw": "yaw",
    "vertical": "roll",
    "roll": "roll",
}
JointKey = tuple[object, str]
Element = tuple[str, JointKey]  # kind of a linear effect and its joint
Numbers = tuple[int | None, ...]  # of a location: None for all of its wheelsets or joints, then each of them


def candidate_locations(model: Model, record: core.Record) -> list[tuple[str, Numbers]]:
    """List the locations of an effect of the catalogue with their numbers.

    Elements that join the same bodies feel the same motion: one of them stands for all, the damper for the law of a
    damper, else that with the largest stiffness.
    """
    structure = model.design.structure
    if structure is None:
        names = [str(at) for at in record["at"]]
        return [(at, (None, 1, 2) if at in WHEELSET_LOCATIONS else (None,)) for at in names]
    if record["acts"] == "body":
        return []  # the vehicle has a body above its frames already
    return [
        (at, location_numbers(structure, at))
        for at in distinct_locations(model, prefer_damping=record["damper"])
        if structure.effect_locations[at].catalogue_name in record["at"]
    ]


def location_numbers(structure: Structure, at: str) -> Numbers:
    """Return None for all joints or bodies of a location, then each of them where there are several."""
    numbers = structure.effect_locations[at].numbers
    return (None, *numbers) if len(numbers) > 1 else (None,)


def distinct_locations(model: Model, *, prefer_damping: bool = False) -> list[str]:
    """List the locations of a multibody vehicle, a single one of those that move alike."""
    structure = model.design.structure
    assert structure is not None
    linear = model.local_elements
    best: dict[tuple[object, str], tuple[float, float, str]] = {}
    joints = dict(_joint_locations(structure))
    for at, location in structure.effect_locations.items():
        key = joints.get(at, (at, ""))
        stiffness, damping = linear.get((at, location.numbers[0]), (0.0, 0.0))
        rank = (damping, stiffness) if prefer_damping else (stiffness, damping)
        if key not in best or rank > best[key][:2]:
            best[key] = (*rank, at)
    return [at for at in structure.effect_locations if at in {name for *_, name in best.values()}]


def estimated_elements(model: Model, estimated: Collection[str]) -> set[Element]:
    """Return the springs and dampers that are estimated parameters of the vehicle already, each with its joint."""
    structure = model.design.structure
    if structure is None:
        secondary = ("secondary_lateral", "secondary_yaw")
        return {(kind, joint_key(model, at)) for kind in ("spring", "viscous_damper") for at in secondary}
    elements: set[Element] = set()
    for part in structure.elements:
        for way, direction in DIRECTION_OF_WAY.items():
            for number, kind in (("stiffness", "spring"), ("damping", "viscous_damper")):
                key = f"{way}_{number}"
                if key in part.keys and set(structure.paths_of(part.number_path(key))) & set(estimated):
                    elements.add((kind, joint_key(model, f"{part.name}_{direction}")))
    return elements


def location_of_number(structure: Structure, path: str) -> str:
    """Return the location of a number of an element, or of a body or wheelset, in the direction in which it acts."""
    parts = {part.path: part for part in (*structure.elements, *structure.bodies)}
    part = next(part for start, part in parts.items() if path.startswith(f"{start}."))
    if part.kind in ("body", "wheelset"):
        name = "wheelset" if part.kind == "wheelset" else part.name
        return f"{name}_yaw" if path.endswith(".yaw_inertia") else name
    if part.kind == "link":
        return part.name
    key = path.removeprefix(f"{part.path}.")
    own = "roll" if part.kind == "anti_roll_bar" else part.word("direction", "lateral")
    way = next((way for way in DIRECTION_OF_WAY if key.startswith(f"{way}_")), own)
    at = f"{part.name}_{DIRECTION_OF_WAY[way]}"
    return at if at in structure.effect_locations else f"{part.name}_lateral"


def joint_key(model: Model, at: str) -> JointKey:
    """Return what the locations of one joint have in common: the bodies that it joins and the direction."""
    structure = model.design.structure
    return (at, "") if structure is None else dict(_joint_locations(structure)).get(at, (at, ""))


def _joint_locations(structure: Structure) -> Iterator[tuple[str, tuple[object, str]]]:
    """Yield the location of every element in each direction, with the bodies that it joins and the direction."""
    for part in structure.elements:
        if part.kind == "wheelset":
            continue
        ends = frozenset(frozenset(map(str, j.ends)) for j in structure.joints if j.part is part)
        if part.kind == "link":
            yield part.name, (ends, "along")
        else:
            yield from ((f"{part.name}_{way}", (ends, way)) for way in ("lateral", "yaw", "roll"))
