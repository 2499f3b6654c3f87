"""Vehicle of the standard job."""

from __future__ import annotations

from typing import Final

# the check values of the model, with creep saturation and flange contact (Kaas-Petersen's rail)
BOGIE: Final = """\
name: standard job
vehicle:
  frame: {mass: 2900, yaw_inertia: 3300}
  wheelset: {mass: 1850, yaw_inertia: 1050, spin_inertia: 120}
  geometry: {half_wheelbase: 1.28, half_gauge: 0.75, half_spring_base: 1.0, rolling_radius: 0.46}
  wheel_load: 55e3
  primary: {lateral_stiffness: 3.0e6, longitudinal_stiffness: 8e6}
  secondary: {lateral_damping: 3e4, yaw_damping: 3e4}
contact:
  leading: {conicity: 0.18, longitudinal_creep: 130, lateral_creep: 120, gravitational_stiffness: 8}
  trailing: {conicity: 0.18, longitudinal_creep: 130, lateral_creep: 120, gravitational_stiffness: 8}
  flange_clearance: 7 mm
effects:
  - {kind: creep_saturation, at: contact, friction: 0.35}
  - {kind: flange_contact, at: contact, clearance: 7 mm, stiffness: 14.6 MN/m}
"""
