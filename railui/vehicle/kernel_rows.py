"""Numbers of a design and its effects in the order of the kernel."""

from __future__ import annotations

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.core import Placement
from railui.vehicle.design_reader import Design, PlacedEffect
from railui.vehicle.kernel_layout import structure_paths


def parameter_values(design: Design) -> FloatArray:
    """Return the numbers of a design in the kernel's order, [parameter]."""
    return np.array([design.values[path] for path in parameter_paths(design)])


def parameter_paths(design: Design) -> tuple[str, ...]:
    """Return the paths of a design's numbers in the kernel's order."""
    if design.structure is not None:
        return structure_paths(design.structure)
    return core.parameter_paths(design.kind, rig_input(design))


def effect_row(effect: PlacedEffect) -> list[float]:
    """Return the numbers of an effect in the kernel's order."""
    return core.effect_numbers(effect.kind, effect.parameters)


def kernel_placement(effect: PlacedEffect) -> Placement:
    """Return the kernel's record of an effect and its location."""
    return Placement(effect.kind, effect.at, effect.wheelset, len(effect_row(effect)), effect.against)


def rig_input(design: Design) -> str | None:
    """Return the input of a rig, None for any other vehicle."""
    return design.rig_input if design.kind == "rig" else None
