"""Topology of a design for drawing: that of its bodies and elements, or of a bogie written out as such."""

from __future__ import annotations

from railui.vehicle.design import Design
from railui.vehicle.design_reader import parse_design
from railui.vehicle.division import with_common_numbers
from railui.vehicle.multibody import Structure

# only places count in a drawing: masses and the numbers of springs and dampers are placeholders
_BOGIE = """\
vehicle:
  bodies:
    frame: {{mass: 1000, yaw_inertia: 1000}}
  elements:
    wheelset: {{kind: wheelset, under: frame, half_wheelbase: {half_wheelbase:.9g}, mass: 1000, yaw_inertia: 1000,
               half_gauge: {half_gauge:.9g}, rolling_radius: {rolling_radius:.9g}, wheel_load: 5e4}}
    primary: {{kind: spring, between: [wheelset, frame], y: {half_spring_base:.9g}, lateral_stiffness: 1e6,
              longitudinal_stiffness: 1e6}}
    secondary: {{kind: spring, between: [frame, ground], lateral_stiffness: 1e5, yaw_stiffness: 1e5}}
    secondary_damper: {{kind: damper, between: [frame, ground], lateral_damping: 1e4, yaw_damping: 1e4}}
contact:
  wheels: {{conicity: 0.1, longitudinal_creep: 100, lateral_creep: 100, gravitational_stiffness: 0}}
"""
_GEOMETRY = ("half_wheelbase", "half_gauge", "half_spring_base", "rolling_radius")


def drawn_topology(design: Design) -> tuple[Structure, dict[str, float]]:
    """Return bodies and elements of a design on track, with their numbers by path.

    Raises
    ------
    ValueError
        For a rig, which has no wheelsets.
    """
    if design.structure is not None:
        return design.structure, with_common_numbers(design.values, design.structure)
    if design.kind != "bogie":
        raise ValueError(f"a {design.kind} has no wheelsets")
    numbers = {key: design.value(f"vehicle.geometry.{key}") for key in _GEOMETRY}
    written_out = parse_design(_BOGIE.format(**numbers))
    assert written_out.structure is not None
    return written_out.structure, dict(written_out.values)
