"""Joints of the coach of 17 degrees of freedom, and the effects that act there, on many vehicles side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.truth.coach import FRAMES, V_PLACES, WHEELSETS, Coach
from tests.truth.effects import KINDS, Effect
from tests.truth.laws import Array
from tests.truth.placed import harmonics_of_rumble

STIFF = ("spring", "bump_stop", "hysteresis", "maxwell_damper", "hung_mass")  # kinds with a stiffness [N/m]
STEP = 1.6  # largest rate of an effect [1/step] at which the integration follows it


def numbers_of(at: str) -> tuple[int, ...]:
    """Numbers of the joints or bodies of a location."""
    return (1, 2, 3, 4) if at.startswith(("primary", "contact")) else (1, 2) if at != "body" else (0,)


def row_at(c: Coach, at: str, number: int) -> Array:
    """Motion of a joint [17]: of the lower body less the upper one; by virtual work also where its force acts."""
    row = np.zeros(V_PLACES)
    if at.startswith("primary"):
        wheel, bogie, side = WHEELSETS[number - 1], (number - 1) // 2, 1 if number % 2 else -1
        if at == "primary_yaw":
            row[[wheel + 1, FRAMES[bogie] + 1]] = 1.0, -1.0
        else:
            row[[wheel, FRAMES[bogie], FRAMES[bogie] + 1, FRAMES[bogie] + 2]] = 1.0, -1.0, -side * c.a, -(c.r - c.h_f)
    elif at in ("body", "frame"):
        row[{"body": 0, "frame": FRAMES[number - 1]}[at]] = 1.0
    else:
        frame, side = FRAMES[number - 1], 1 if number == 1 else -1
        if at == "secondary_yaw":
            row[[frame + 1, 1]] = 1.0, -1.0
        elif at == "anti_roll_bar_roll":
            row[[frame + 2, 2]] = 1.0, -1.0
        else:
            row[[frame, frame + 2, 0, 1, 2]] = 1.0, c.secondary_h - c.h_f, -1.0, -side * c.a_c, -(c.secondary_h - c.h)
    return row


def linear_element(c: Coach, at: str) -> tuple[float, float]:
    """Stiffness and damping of the element at a location."""
    return {
        "primary_lateral": (2.0 * c.primary[1], 0.0),
        "primary_yaw": (2.0 * c.primary[0] * c.primary_y**2, 0.0),
        "secondary_lateral": (2.0 * c.secondary[1], 2.0 * c.secondary_c[1]),
        "lateral_damper_lateral": (2.0 * c.secondary[1], 2.0 * c.secondary_c[1]),
        "secondary_yaw": (2.0 * c.secondary[0] * c.secondary_y**2, 0.0),
        "anti_roll_bar_roll": (c.anti_roll, 0.0),
    }.get(at, (0.0, 0.0))


@dataclass(frozen=True)
class _Joint:
    """A joint with an effect: its vehicle k, motion [17], the numbers of the effect and the first of its states."""

    k: int
    row: Array
    numbers: dict[str, Any]
    first_state: int


class JointEffects:
    """Force effects at the joints of vehicles side by side, evaluated kind by kind."""

    def __init__(self, coaches: Sequence[Coach], effects: Sequence[Sequence[Effect]], inverse_mass: Array) -> None:
        by_kind: dict[str, list[_Joint]] = {}
        used = [0] * len(coaches)
        for k, (c, some) in enumerate(zip(coaches, effects, strict=True)):
            for one in some:
                if one.at == "contact":
                    continue
                k0, c0 = linear_element(c, one.at)
                for number in numbers_of(one.at) if one.wheelset is None else (one.wheelset,):
                    numbers = {**one.filled(), "k0": k0, "c0": c0}
                    by_kind.setdefault(one.kind, []).append(_Joint(k, row_at(c, one.at, number), numbers, used[k]))
                    used[k] += KINDS[one.kind].states
        joints = [x for some in by_kind.values() for x in some]
        self.states = max(used, default=0)
        self.at = np.array([x.k for x in joints], int)
        self.R = np.array([x.row for x in joints]).reshape(-1, V_PLACES).T  # [17, joint]
        self.by_mass = self.R * inverse_mass[:, self.at]
        self.of_vehicle = (self.at[:, None] == np.arange(len(coaches))).astype(float)  # [joint, vehicle]
        ends = np.cumsum([len(some) for some in by_kind.values()])
        self.kinds = [
            (slice(end - len(some), end), kind, _side_by_side(kind, some), _slots(kind, some))
            for end, (kind, some) in zip(ends, by_kind.items(), strict=True)
        ]

    def accelerations(self, q: Array, v: Array, own: Array, t: float) -> tuple[Array, Array]:
        """Accelerations [17, vehicle], and the rates of the states of the effects."""
        rates = np.zeros_like(own)
        z, dz = (np.einsum("ij,ij->j", self.R, x[:, self.at]) for x in (q, v))
        forces = np.zeros(len(self.at))
        for part, kind, p, slots in self.kinds:
            at = self.at[part]
            forces[part], of_states = _force(kind, p, z[None, part], dz[None, part], own[slots, at][:, None], t)
            if of_states is not None:
                rates[slots, at] = of_states[:, 0]
        return (self.by_mass * forces) @ self.of_vehicle, rates


def _side_by_side(kind: str, joints: Sequence[_Joint]) -> dict[str, Any]:
    p: dict[str, Any] = {name: np.array([x.numbers[name] for x in joints], float) for name in joints[0].numbers}
    if kind == "frame_rumble":
        p["harmonics"] = [harmonics_of_rumble(x.numbers["highest"], int(x.numbers["seed"])) for x in joints]
    return {**p, "at": ""}


def _slots(kind: str, joints: Sequence[_Joint]) -> Any:
    return np.arange(KINDS[kind].states)[:, None] + np.array([x.first_state for x in joints])  # [state, joint]


def _force(kind: str, p: dict[str, Any], z: Array, v: Array, own: Array, t: float) -> tuple[Array, Array | None]:
    """Force along the motion of every joint of a kind, and the rates of its states [state, 1, joint]."""
    law, many = KINDS[kind].law, KINDS[kind].many
    if law is not None:
        force, rates = law(p, z, v, own, t)
        return force[0], rates
    pushed: list[Array] = []
    assert many is not None
    rates = many(p, lambda _: z, lambda _: v, lambda _, force: pushed.append(force), own, t)
    return pushed[0][0], rates


def steps_for(c: Coach, effects: Sequence[Effect], inverse_mass: Array, dt: float) -> int:
    """Steps per sample that follow the stiffest effect."""
    rates = [0.0]
    for one in effects:
        if one.at == "contact":
            continue
        compliance = max(float(row_at(c, one.at, n) ** 2 @ inverse_mass) for n in numbers_of(one.at))  # 1/kg
        p = one.parameters
        c_v = p["force"] / p["slip_speed"] * (1.0 + p.get("rise", 0.0)) if "slip_speed" in p else 0.0
        c_v += p["damping"] if one.kind == "viscous_damper" else 0.0
        k = linear_element(c, one.at)[0] + (p["stiffness"] if one.kind in STIFF else 0.0)
        rates += [c_v * compliance, float(np.sqrt(k * compliance))]
        if one.kind == "maxwell_damper":
            rates.append(p["stiffness"] / p["damping"])
    return int(np.ceil(max(rates) * dt / STEP))
