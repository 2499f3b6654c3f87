"""Parts of a schematic that an effect concerns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from railui.report.schematic.places import Places, joint_key

AT_CONTACT = ("contact", "track")


@dataclass(frozen=True)
class Highlight:
    """Effect to highlight: its location, one of several joints or wheelsets (None: all), and the text of its label."""

    at: str
    number: int | None
    text: str


@dataclass(frozen=True)
class Concerned:
    """Keys of what a highlight concerns: joints, bodies and wheelsets, wheels on rails (wheelset names), sensors."""

    joints: tuple[str, ...] = ()
    bodies: tuple[str, ...] = ()
    contacts: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ()


def concerned_parts(places: Places, highlight: Highlight, sensors: Mapping[str, object]) -> Concerned:
    """Return the parts of the drawing at the location of an effect; empty where the drawing has none."""
    structure, at, number = places.structure, highlight.at, highlight.number
    if at in sensors:
        return Concerned(sensors=(at,))
    if joints := [j for j in structure.joints if at in j.locations]:
        return Concerned(joints=tuple(joint_key(j) for j in joints if not number or j.number == number))
    wheelsets = tuple(w.name for w in structure.wheelsets if not number or w.number == number)
    if at in AT_CONTACT:
        return Concerned(contacts=wheelsets)
    if at in ("wheelset", "wheelset_yaw"):
        return Concerned(bodies=wheelsets)
    name = at.removesuffix("_yaw").removesuffix("_roll")
    bodies = [m.name for m in structure.members_named(at) or structure.members_named(name) if not m.is_wheelset]
    chosen = [b for b in bodies if not number or structure.members[b].number == number]
    return Concerned(bodies=tuple(chosen))
