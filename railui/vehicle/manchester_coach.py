"""Coach of designs/manchester_coach.yaml, which names its sources: of the self-test and of the standard job."""

from __future__ import annotations

from typing import Final

COACH: Final = """\
name: standard job, coach
vehicle:
  bodies:
    body: {mass: 32000, yaw_inertia: 1.97e6, roll_inertia: 56.8e3, height: 1.8}
    frame: {half_centres: 9.5, mass: 2615, yaw_inertia: 3067, roll_inertia: 1722, height: 0.6}
  elements:
    wheelset: {kind: wheelset, under: frame, half_wheelbase: 1.28, mass: 1813, yaw_inertia: 1120, spin_inertia: 112,
               half_gauge: 0.75, rolling_radius: 0.46, wheel_load: 54.546 kN}
    primary: {kind: spring, between: [wheelset, frame], y: 1.0, height: 0.46, longitudinal_stiffness: 31.391e6,
              lateral_stiffness: 3.884e6, vertical_stiffness: 1.22e6, static_load: 45.65 kN}
    primary_damper: {kind: damper, between: [wheelset, frame], y: 1.0, height: 0.46, vertical_damping: 4e3}
    secondary: {kind: spring, between: [frame, body], y: 1.0, height: 0.8275, longitudinal_stiffness: 0.16e6,
                lateral_stiffness: 0.16e6, vertical_stiffness: 0.43e6, roll_stiffness: 10.5e3, static_load: 78.48 kN}
    secondary_damper: {kind: damper, between: [frame, body], y: 1.0, height: 0.8275, vertical_damping: 20e3}
    lateral_damper: {kind: damper, between: [frame, body], y: 1.0, height: 0.8275, lateral_damping: 32e3}
    anti_roll_bar: {kind: anti_roll_bar, between: [frame, body], stiffness: 940e3}
    bump_stop: {kind: stop, between: [frame, body], height: 0.8275, gap: 25 mm, stiffness: 1 MN/m}
  floor:
    over_leading_bogie: {body: body, x: 9.5, height: 1.2}
    middle: {body: body, x: 0, height: 1.2}
    over_trailing_bogie: {body: body, x: -9.5, height: 1.2}
contact:
  wheels: {conicity: 0.1, longitudinal_creep: 140, lateral_creep: 125, gravitational_stiffness: 6}
  spin_creep: 0.25
  flange_clearance: 7 mm
effects:
  - {kind: creep_saturation, at: contact, friction: 0.35}
  - {kind: flange_contact, at: contact, clearance: 7 mm, stiffness: 14.6 MN/m}
"""
