"""The balance of a vehicle of bodies: its wheels carry its masses."""

from __future__ import annotations

from collections.abc import Mapping

from .bodies import Structure
from .problems import Findings

GRAVITY = 9.81
SHARE = 0.10  # by which the wheel loads may differ from the weight of the masses


def balance(structure: Structure, values: Mapping[str, float], findings: Findings) -> None:
    """Warns where the wheel loads do not carry the masses; where something rests on the ground, it may be any."""
    load = 2 * sum(values[w.part.at("wheel_load")] for w in structure.wheelsets)
    weight = GRAVITY * sum(values[m.part.at("mass")] for m in structure.members.values())
    low, high = (1 - SHARE) * weight, (1 + SHARE) * weight
    grounded = any(None in joint.ends for joint in structure.joints)
    if load < low or (load > high and not grounded):
        told = f"the wheels carry {load / 1e3:.4g} kN, the masses weigh {weight / 1e3:.4g} kN"
        findings.warn(structure.wheelsets[0].part.at("wheel_load"), told, "check the masses and the load per wheel")
