"""Joints of the coach of 17 degrees of freedom, and the effects that act there, on many vehicles side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.truth.coach import FRAMES, V_PLACES, WHEELSETS, Coach
from tests.truth.effects import KINDS, Effect
from tests.truth.laws import Array
from tests.truth.placed import harmonics_of_rumble

STIFF = ("spring", "bump_stop", "hysteresis", "maxwell_damper", "hung_mass")  # kinds with a stiffness [N/m]
STEP = 1.2  # largest rate of an effect [1/step] at which the integration follows it


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


@dataclass
class Joints:
    """Joints with an effect of one kind: vehicle, motion and parameters of each."""

    kind: str
    vehicles: list[int] = field(default_factory=list)
    rows: list[Array] = field(default_factory=list)
    numbers: list[dict[str, Any]] = field(default_factory=list)
    first_states: list[int] = field(default_factory=list)

    def add(self, k: int, c: Coach, effect: Effect, number: int, first_state: int) -> None:
        """Add the joint of a vehicle."""
        k0, c0 = linear_element(c, effect.at)
        self.vehicles.append(k)
        self.rows.append(row_at(c, effect.at, number))
        self.numbers.append({**effect.filled(), "k0": k0, "c0": c0})
        self.first_states.append(first_state)

    def prepare(self) -> None:
        """Arrange the numbers of all joints in arrays."""
        self.at = np.array(self.vehicles)
        self.R = np.stack(self.rows, axis=1)  # [17, joint]
        self.p: dict[str, Any] = {"at": ""}
        self.p |= {name: np.array([x[name] for x in self.numbers], float) for name in self.numbers[0]}
        if self.kind == "frame_rumble":
            self.p["harmonics"] = [harmonics_of_rumble(x["highest"], int(x["seed"])) for x in self.numbers]
        self.slots = np.arange(KINDS[self.kind].states)[:, None] + np.array(self.first_states)  # [state, joint]

    def forces(self, q: Array, v: Array, own: Array, t: float) -> tuple[Array, Array | None]:
        """Force along the motion of every joint, and the rates of the states of the laws [state, joint]."""
        z, dz = ((self.R * x[:, self.at]).sum(axis=0)[None] for x in (q, v))
        states = own[self.slots, self.at][:, None]
        kind = KINDS[self.kind]
        if kind.law is not None:
            force, rates = kind.law(self.p, z, dz, states, t)
            return force[0], None if rates is None else rates[:, 0]
        pushed: list[Array] = []
        assert kind.many is not None
        rates = kind.many(self.p, lambda _: z, lambda _: dz, lambda _, force: pushed.append(force), states, t)
        return pushed[0][0], None if rates is None else rates[:, 0]


def joints_of(coaches: Sequence[Coach], effects: Sequence[Sequence[Effect]]) -> tuple[list[Joints], int]:
    """Gather the force effects of all vehicles by kind; the number of states that the laws of a vehicle need."""
    found: dict[str, Joints] = {}
    used = [0] * len(coaches)
    for k, (c, some) in enumerate(zip(coaches, effects, strict=True)):
        for one in some:
            if one.at == "contact":
                continue
            for number in numbers_of(one.at) if one.wheelset is None else (one.wheelset,):
                found.setdefault(one.kind, Joints(one.kind)).add(k, c, one, number, used[k])
                used[k] += KINDS[one.kind].states
    for joints in found.values():
        joints.prepare()
    return list(found.values()), max(used, default=0)


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
