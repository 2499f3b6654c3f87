"""Equilibrium of wheel loads and masses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from railui.core import adds_body
from railui.io.problems import Findings, Problem
from railui.track.line_geometry import GRAVITY
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.multibody import Structure

if TYPE_CHECKING:
    from railui.vehicle.design import Design

WEIGHT_TOLERANCE = 0.10  # relative difference of the wheel loads from the weight of the masses
MAX_WHEEL_LOAD = 200e3  # N; 40 t per axle, the heaviest on any railway
REMEDY = "check the masses and the load per wheel"


def check_wheel_loads(structure: Structure, values: Mapping[str, float], findings: Findings) -> None:
    """Warn if the wheel loads do not carry the masses; elements to the ground may carry any part of them."""
    load = 2 * sum(values[w.part.number_path("wheel_load")] for w in structure.wheelsets)
    weight = GRAVITY * sum(values[m.part.number_path("mass")] for m in structure.members.values())
    low, high = (1 - WEIGHT_TOLERANCE) * weight, (1 + WEIGHT_TOLERANCE) * weight
    grounded = any(None in joint.ends for joint in structure.joints)
    if load < low or (load > high and not grounded):
        message = f"the wheels carry {load / 1e3:.4g} kN, the masses weigh {weight / 1e3:.4g} kN"
        findings.warn(structure.wheelsets[0].part.number_path("wheel_load"), message, REMEDY)


def wheel_load_warnings(design: Design) -> tuple[Problem, ...]:
    """Return warnings on wheel loads that do not carry the masses, for a design with changed values."""
    findings = Findings("override")
    if design.structure is not None:
        check_wheel_loads(design.structure, design.values, findings)
    elif design.kind == "bogie":
        check_bogie_wheel_loads(design.values, design.effects, findings)
    return findings.warnings()


def check_bogie_wheel_loads(values: Mapping[str, float], effects: Sequence[PlacedEffect], findings: Findings) -> None:
    """Warn if four wheel loads do not carry the masses of a bogie; an unknown coach may have any mass."""
    path = "vehicle.wheel_load"
    load = 4 * values[path]
    coach = [float(m) for e in effects if adds_body(e.kind) and isinstance(m := e.parameters.get("mass"), float)]
    weight = GRAVITY * (values["vehicle.frame.mass"] + 2 * values["vehicle.wheelset.mass"] + sum(coach))
    carried = f"4 x wheel load is {load / 1e3:.4g} kN, the masses"
    if load < (1 - WEIGHT_TOLERANCE) * weight:
        share = "" if coach else ", and a coach would add to them"
        findings.warn(path, f"{carried} weigh {weight / 1e3:.4g} kN{share}", REMEDY)
    elif coach and load > (1 + WEIGHT_TOLERANCE) * weight:
        findings.warn(path, f"{carried} with the coach's share weigh {weight / 1e3:.4g} kN", REMEDY)
    elif load > 4 * MAX_WHEEL_LOAD:
        message = f"{load / 4e3:.4g} kN on a wheel is more than any railway carries"
        findings.warn(path, message, "give the load of one wheel in N")
