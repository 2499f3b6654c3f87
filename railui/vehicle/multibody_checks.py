"""Checks of the topology of multibody vehicles."""

from __future__ import annotations

from collections.abc import Mapping

from railui.io.problems import Findings, suggest_name
from railui.vehicle.element_kinds import GROUND
from railui.vehicle.multibody import Structure, position
from railui.vehicle.multibody_parts import Member, Part

MAX_DEGREES_OF_FREEDOM = 32  # 64 states, the kernel's capacity for one vehicle
MAX_WHEELSETS = 12  # 64 columns of the input table, of which a wheelset reads five


def check_structure(structure: Structure, values: Mapping[str, float], findings: Findings) -> None:
    """Report wrong names, exceeded limits, and wheelsets, elements and floor points that do not fit."""
    _check_names(structure, findings)
    if findings.errors() or not _fits_kernel(structure, findings):
        return
    for member in structure.members.values():
        _check_member(member, findings)
    for wheelset in structure.wheelsets:
        _check_wheelset(structure, wheelset, findings)
    if not structure.wheelsets:
        findings.add("vehicle.elements", "has no wheelset", "add an element `kind: wheelset`")
    for part in structure.elements:
        if part.kind != "wheelset":
            _check_joint(structure, part, findings)
    for part in structure.floor:
        _check_floor_point(structure, part, findings)
    if not findings.errors():
        _check_order(structure, values, findings)


def _fits_kernel(structure: Structure, findings: Findings) -> bool:
    """Report a vehicle that is too large for the kernel; return False for it."""
    degrees = sum(member.dof_count for member in structure.members.values())
    if degrees > MAX_DEGREES_OF_FREEDOM:
        message = f"has {degrees} degrees of freedom, at most {MAX_DEGREES_OF_FREEDOM} are possible"
        findings.add("vehicle", message, "join bodies that move together")
        return False
    wheelsets = len(structure.wheelsets)
    if wheelsets > MAX_WHEELSETS:
        message = f"has {wheelsets} wheelsets, at most {MAX_WHEELSETS} are possible"
        findings.add("vehicle", message, "model the relevant part of the train")
        return False
    return True


def _check_member(member: Member, findings: Findings) -> None:
    part = member.part
    if part.kind == "body" and {"x", "half_centres"} <= set(part.keys):
        findings.add(part.path, "has x and half_centres", "give one of them")
    if member.has_rotation("roll") and "height" not in part.keys:
        findings.add(part.path, "rolls, but its centre has no height", "add `height:` above the rails")


def _check_wheelset(structure: Structure, wheelset: Member, findings: Findings) -> None:
    part = wheelset.part
    if wheelset.carrier is None and "x" not in part.keys and len(structure.wheelsets) > 1:
        findings.add(part.path, "has no position", "add `x:`, or `under:` a body with `half_wheelbase:`")
    if {"x", "half_wheelbase"} <= set(part.keys):
        findings.add(part.path, "has x and half_wheelbase", "give one of them")
    if wheelset.carrier is None and "half_wheelbase" in part.keys:
        findings.add(part.number_path("half_wheelbase"), "needs the body between the two", "add `under:`")
    contact = structure.contact_of(wheelset)
    if contact not in structure.contacts:
        remedy = suggest_name(contact, structure.contacts) if structure.contacts else "add `contact:` with a group"
        path = part.number_path("contact") if "contact" in part.words else part.path
        findings.add(path, f"no contact {contact!r}" if contact else "has no contact", remedy)


def _check_floor_point(structure: Structure, part: Part, findings: Findings) -> None:
    body = part.word("body")
    if len(structure.members_named(body)) != 1:
        path = part.number_path("body") if body else part.path
        findings.add(path, f"no body {body!r}" if body else "names no body", suggest_name(body, structure.members))


def _check_names(structure: Structure, findings: Findings) -> None:
    parts_by_name: dict[str, Part] = {}
    for part in (*structure.bodies, *structure.elements):
        if part.name in parts_by_name:
            findings.add(
                part.path, f"has the same name as {parts_by_name[part.name].path}", "rename one of them", key=True
            )
        parts_by_name[part.name] = part
    families = [part.name for part in structure.bodies]
    paired = [f"{p.name}_{i}" for p in structure.bodies if "half_centres" in p.keys for i in (1, 2)]
    for part in structure.wheelset_parts:
        under = part.word("under")
        if under and under not in (*families, *paired):
            findings.add(part.number_path("under"), f"no body {under!r}", suggest_name(under, [*families, *paired]))


def _check_joint(structure: Structure, part: Part, findings: Findings) -> None:
    if "between" not in part.words:
        return
    known = [*dict.fromkeys(m.part.name for m in structure.members.values()), *structure.members, GROUND]
    before = len(findings.errors())
    for i, end in enumerate(part.between):
        if end != GROUND and not structure.members_named(end):
            findings.add(part.number_path(f"between.{i}"), f"no body {end!r}", suggest_name(end, dict.fromkeys(known)))
    if len(findings.errors()) > before:
        return
    try:
        joints = structure.joints_of(part)
    except ValueError as error:
        findings.add(part.number_path("between"), str(error), "name one of them with its number, such as frame_1")
        return
    if any(a == b for joint in joints for a, b in [joint.ends]):
        findings.add(part.number_path("between"), "joins a body to itself", "name two bodies")
    if (
        "height" not in part.keys
        and part.kind != "anti_roll_bar"
        and any(structure.joins_rolling_body(j) for j in joints)
    ):
        findings.add(part.path, "joins a body that rolls, but has no height", "add `height:` above the rails")


def _check_order(structure: Structure, values: Mapping[str, float], findings: Findings) -> None:
    positions = [position(structure, member, values) for member in structure.wheelsets]
    for i in range(1, len(positions)):
        if positions[i] >= positions[i - 1]:
            part = structure.wheelsets[i].part
            remedy = "list wheelsets from front to rear, with decreasing x"
            findings.add(
                part.path, f"{structure.wheelsets[i].name} is not behind the wheelset listed before it", remedy
            )
