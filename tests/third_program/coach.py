"""A coach on two bogies, of Exudyn's bodies, connectors and constraints: springs that lean with what they join."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from exudyn import OutputVariableType as Output
from numpy.typing import NDArray

from tests.third_program.contact import Wheels
from tests.third_program.multibody import PITCH, ROLL, YAW, Body, Forces, Law, Multibody
from tests.third_program.rail_table import RailTable, Run
from tests.third_program.sensors import Sensors

Floats = NDArray[np.float64]
FLOOR = {"floor_front": 9.5, "floor_middle": 0.0, "floor_rear": -9.5}  # x of the accelerometers [m]
FLOOR_DEPTH = 0.6  # below the body's centre of mass [m]
NO_TURN = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Spring:
    """Stiffness and damping along x, y, z of one side, and the place across and above the rails; load [N]."""

    k: tuple[float, float, float]
    c: tuple[float, float, float]
    y: float
    height: float
    load: float


@dataclass(frozen=True)
class Coach:
    """Numbers of a coach, SI: mass, moments of inertia about x, y, z and height of each body."""

    body: tuple[float, float, float, float, float]
    frame: tuple[float, float, float, float, float]
    wheelset: tuple[float, float, float]  # mass, moments about x (and y), z
    half_centres: float
    half_wheelbase: float
    primary: Spring
    secondary: Spring
    roll: float  # of anti-roll bar and springs of a bogie [N*m/rad]
    stop: tuple[float, float]  # gap [m], stiffness [N/m] of a bogie
    wheels: Wheels


def simulate(
    coach: Coach, run: Run, unmodelled: Law | None = None, per_sample: int = 4, stops: bool = True
) -> dict[str, Floats]:
    """Channels of the coach along a run, from rest; `unmodelled` acts across the secondary of each bogie."""
    system, a = Multibody(), coach.half_wheelbase
    places = [s * coach.half_centres + w for s in (1, -1) for w in (a, -a)]
    table = RailTable(run, tuple(places[0] - x for x in places), per_sample)
    sensors = Sensors(system, table)
    body = _solid(system, coach.body, 0.0)
    frames = [_solid(system, coach.frame, s * coach.half_centres) for s in (1, -1)]
    wheelsets = []
    for i, x in enumerate(places):
        wheelset = _wheelset(system, coach, table, i, x)
        sensors.wheelset(i, wheelset, _pair(system, wheelset, frames[i // 2], coach.primary), Output.DisplacementLocal)
        wheelsets.append(wheelset)
    for frame, name in zip(frames, ("front", "rear"), strict=True):
        _pair(system, frame, body, coach.secondary)
        middle = (frame.x, 0.0, coach.secondary.height)
        system.add_mean_frame_spring(frame, body, middle, (0.0, 0.0, 0.0, coach.roll, 0.0, 0.0), 6 * (0.0,))
        for law in [_stop(*coach.stop)] * stops + [unmodelled] * (unmodelled is not None):
            system.add_spring(frame, body, middle, NO_TURN, NO_TURN, law=law)
        sensors.acceleration(f"ay_{name}", frame)
        sensors.yaw_rate(f"rf_{name}", frame)
    sensors.acceleration("ay_body", body)
    for name, x in FLOOR.items():
        sensors.acceleration(name, body, (x, 0.0, body.height - FLOOR_DEPTH))
    system.add_forces(wheelsets, _rails(coach, table))
    system.integrate(table.step, table.steps, per_sample)
    return sensors.read()


def _solid(system: Multibody, numbers: tuple[float, float, float, float, float], x: float) -> Body:
    mass, about_x, about_y, about_z, height = numbers
    return system.add_body(mass, (about_x, about_y, about_z), x, height)


def _wheelset(system: Multibody, coach: Coach, table: RailTable, index: int, x: float) -> Body:
    """A wheelset on stiff rails: it leans by a constraint of Exudyn, which hands its roll moment to the rails."""
    mass, about_x, about_z = coach.wheelset
    wheelset = system.add_body(mass, (about_x, about_x, about_z), x, coach.wheels.radius)
    system.fix(wheelset, 0, 2, PITCH)
    system.constrain_roll(
        wheelset,
        coach.wheels.roll / coach.wheels.half_gauge,
        lambda t: coach.wheels.forced_roll(table.under(index, t)),
    )
    return wheelset


def _pair(system: Multibody, lower: Body, upper: Body, spring: Spring) -> list[int]:
    """The springs of both sides."""
    x = lower.x
    return [
        system.add_mean_frame_spring(
            lower, upper, (x, y, spring.height), (*spring.k, *NO_TURN), (*spring.c, *NO_TURN), spring.load
        )
        for y in (spring.y, -spring.y)
    ]


def _stop(gap: float, stiffness: float) -> Law:
    return lambda z, v: stiffness * (z - min(max(z, -gap), gap))


def _rails(coach: Coach, table: RailTable) -> Forces:
    wheels = coach.wheels

    def forces(t: float, q: Sequence[float], v: Sequence[float]) -> list[float]:
        out = [0.0] * 24
        for i in range(4):
            rails, at = table.under(i, t), 6 * i
            lateral, yaw = wheels.forces(rails, q[at + 1], v[at + 1], q[at + YAW], v[at + YAW])
            # the couple of the spinning wheels; without the roll rate of the track
            spin = wheels.spin_inertia * rails.speed / wheels.radius
            out[at + 1], out[at + ROLL] = lateral, -spin * v[at + YAW]
            out[at + YAW] = yaw - spin * wheels.roll / wheels.half_gauge * v[at + 1]
        return out

    return forces
