"""Parameters of a multibody vehicle that a campaign estimates by default."""

from __future__ import annotations

from collections.abc import Mapping

from railui.vehicle.multibody import Structure
from railui.vehicle.parameters import WHEELSET_CONTACT

STIFFNESS = ("lateral_stiffness", "longitudinal_stiffness", "yaw_stiffness")
MOUNTED_DAMPING = ("lateral", "longitudinal", "yaw")  # directions of dampers on their mountings
DAMPING = ("lateral_damping", "longitudinal_damping", "yaw_damping")


def default_estimated_of_vehicle(structure: Structure, values: Mapping[str, float]) -> tuple[str, ...]:
    """Return the paths that a campaign estimates by default, by analogy with those of a bogie.

    The wheel-rail contact, the lateral and yaw stiffness of the springs at the wheelsets, and the lateral and yaw
    damping of all other elements, dampers on their mountings included: what is worn or declared as zero, unlike masses,
    geometry and the springs of the body.

    Parameters
    ----------
    structure : Structure
    values : mapping
        Numbers of the vehicle by path; those that are zero are not estimated.
    """
    contact = [f"contact.{name}.{p.path}" for name in structure.contacts for p in WHEELSET_CONTACT]
    paths = [path for shared in contact for path in structure.paths_of(shared)]
    paths.append("contact.spin_creep")
    wheelsets = {w.name for w in structure.wheelsets} | {w.part.name for w in structure.wheelsets}
    for part in structure.elements:
        if "between" not in part.words:
            continue
        keys: tuple[str, ...] = STIFFNESS if part.kind == "spring" and wheelsets & set(part.between) else DAMPING
        if part.kind == "spring_damper" and part.word("direction", "lateral") in MOUNTED_DAMPING:
            keys = ("damping",)
        numbers = [path for k in keys if k in part.keys for path in structure.paths_of(part.number_path(k))]
        paths += [path for path in numbers if values.get(path, 0.0)]
    return tuple(paths)
