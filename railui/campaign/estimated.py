"""Parameters that a campaign estimates, and those of them that differ between joints or wheelsets."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from railui.io.problems import FileProblems, Findings, suggest_name
from railui.vehicle.contact_profiles import GROUP as PROFILES_GROUP
from railui.vehicle.design_reader import Design
from railui.vehicle.division import divide_design, divisible_numbers
from railui.vehicle.multibody_estimated import default_estimated_of_vehicle
from railui.vehicle.parameters import default_estimated

# estimated together, these leave one factor undetermined: the equation of the rig may be multiplied by any number
RIG_EQUATION_FACTORS = ("vehicle.rig.mass", "vehicle.rig.stiffness", "vehicle.rig.damping", "vehicle.rig.gain")
FREE_REMEDY = "leave the key out, or describe the vehicle by bodies and elements (docs/vehicles.md)"


def read_estimated(adjust: Any, free: Any, design: Design, findings: Findings) -> tuple[Design, tuple[str, ...]]:
    """Return the design with one number per joint where `free` asks for it, and the paths to estimate.

    Parameters
    ----------
    adjust, free
        Lists of paths as the campaign file has them; problems join `findings`.
    """
    if not isinstance(free, list) or not free:
        return design, _estimated_parameters(adjust, design, findings)
    if design.structure is None:
        message = f"a {design.kind} has no numbers that several joints share"
        findings.add("free", message, FREE_REMEDY, key=True)
        return design, ()
    estimated = _estimated_parameters(adjust, design, findings)
    freed = [
        path for i, name in enumerate(free) for path in _freed(str(name), f"free.{i}", design, estimated, findings)
    ]
    if findings.errors():
        return design, ()
    design = divide_design(design, list(dict.fromkeys(freed)))
    assert design.structure is not None
    members = [each for path in freed for each in design.structure.paths_of(path)]
    return design, tuple(dict.fromkeys([*_estimated_parameters(adjust, design, findings), *members]))


def _freed(name: str, where: str, design: Design, estimated: Sequence[str], findings: Findings) -> list[str]:
    """Return the shared numbers that an entry of `free` names: one, or of a group those that are estimated."""
    assert design.structure is not None
    known = list(divisible_numbers(design.structure))
    if name in known:
        if name.startswith("contact.") and design.profiles is not None:
            message = "the wheelsets of a group with profiles have the same contact parameters"
            findings.add(where, message, "give every wheelset a contact group of its own")
            return []
        return [name]
    group = [path for path in known if path.startswith(f"{name}.")]
    if chosen := [path for path in group if set(design.structure.paths_of(path)) <= set(estimated)]:
        return chosen
    if group:
        findings.add(where, f"no number of {name!r} is estimated", f"name one of them, such as {group[0]}")
    elif name in design.values:
        remedy = suggest_name(name, [path for path in known if path in estimated])
        findings.add(where, f"{name!r} belongs to one joint, or is no stiffness, damping or contact parameter", remedy)
    else:
        findings.add(where, f"no such parameter {name!r}", suggest_name(name, known))
    return []


def _estimated_parameters(given: Any, design: Design, findings: Findings) -> tuple[str, ...]:
    paths: list[str] = []
    for i, name in enumerate(given if isinstance(given, list) else _default_estimated(design)):
        try:
            found = design.expand(str(name))
            if str(name).startswith(PROFILES_GROUP):
                message = "the numbers of the profiles are not estimated, the contact parameters are"
                findings.add(f"adjust.{i}", message, "write contact.leading, contact.trailing")
            paths += [p for p in found if p not in paths and not p.startswith(f"{PROFILES_GROUP}.")]
        except FileProblems as error:
            findings.add(f"adjust.{i}", f"no such parameter {name!r}", error.problems[0].remedy)
    if given == []:
        findings.add("adjust", "is empty", "name a path, or leave out the key for the default list")
    if set(RIG_EQUATION_FACTORS) <= set(paths):
        findings.add(
            "adjust",
            "mass, stiffness, damping and gain can be determined up to a common factor only",
            "leave vehicle.rig.mass or vehicle.rig.gain out",
        )
    return tuple(paths)


def _default_estimated(design: Design) -> tuple[str, ...]:
    if design.structure is not None:
        return default_estimated_of_vehicle(design.structure, design.values)
    return default_estimated(design.form, design.rig_input)
