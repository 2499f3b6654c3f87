"""A bogie of two wheelsets under a carbody that stands still, of Exudyn's bodies and connectors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from exudyn import OutputVariableType as Output
from numpy.typing import NDArray

from tests.third_program.contact import Wheels
from tests.third_program.multibody import PITCH, ROLL, YAW, Forces, G, Law, Multibody
from tests.third_program.rail_table import RailTable, Run
from tests.third_program.sensors import Sensors

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Bogie:
    """Numbers of a bogie, SI, of each axle box and of the whole secondary suspension."""

    frame_mass: float
    frame_inertia: float
    wheelset_mass: float
    wheelset_inertia: float
    half_wheelbase: float
    half_base: float
    longitudinal: float
    lateral: float
    secondary_lateral: tuple[float, float]  # stiffness, damping
    secondary_yaw: tuple[float, float]
    wheels: tuple[Wheels, Wheels]
    vertical: tuple[float, float] = (1.2e6, 8e3)
    frame_roll: float = 1500.0
    frame_pitch: float = 2500.0


@dataclass(frozen=True)
class Unmodelled:
    """Effects on top of the linear vehicle, by Exudyn's own friction or by laws across the primary suspension."""

    friction: tuple[float, float] | None = None  # dry friction of the secondary [N], linear below this speed [m/s]
    primary: Law | None = None  # of each axle box


NONE = Unmodelled()


def simulate(bogie: Bogie, run: Run, unmodelled: Unmodelled = NONE, per_sample: int = 4) -> dict[str, Floats]:
    """Channels of the bogie along a run, from rest."""
    system, a, height = Multibody(), bogie.half_wheelbase, bogie.wheels[0].radius
    table = RailTable(run, (0.0, 2 * a), per_sample)
    sensors = Sensors(system, table)
    frame = system.add_body(bogie.frame_mass, (bogie.frame_roll, bogie.frame_pitch, bogie.frame_inertia), 0.0, height)
    carried = sum(2 * w.load for w in bogie.wheels) - 2 * bogie.wheelset_mass * G
    system.add_weight(frame, carried - bogie.frame_mass * G)
    k, c = (bogie.longitudinal, bogie.lateral, bogie.vertical[0]), (0.0, 0.0, bogie.vertical[1])
    wheelsets = []
    for i, x in enumerate((a, -a)):
        wheelset = system.add_body(bogie.wheelset_mass, (bogie.wheelset_inertia,) * 3, x, height)
        # the wheelset of the plain bogie: its roll is that of the law of contact, not a motion
        system.fix(wheelset, 0, 2, ROLL, PITCH)
        sides = [(x, y, height) for y in (bogie.half_base, -bogie.half_base)]
        boxes = [system.add_spring(wheelset, frame, at, k, c, carried / 4, unmodelled.primary) for at in sides]
        sensors.wheelset(i, wheelset, boxes, Output.Displacement)
        wheelsets.append(wheelset)
    k_y, c_y = bogie.secondary_lateral
    system.add_spring(system.ground, frame, (0.0, 0.0, height), (0.0, k_y, 0.0), (0.0, c_y, 0.0))
    system.add_torsional_spring(system.ground, frame, *bogie.secondary_yaw)
    if unmodelled.friction is not None:
        system.add_friction(frame, 1, *unmodelled.friction)
    system.add_forces(wheelsets, _rails(bogie, table))
    sensors.acceleration("ayf", frame)
    sensors.yaw_rate("rf", frame)
    system.integrate(table.step, table.steps, per_sample)
    return sensors.read()


def _rails(bogie: Bogie, table: RailTable) -> Forces:
    def forces(t: float, q: Sequence[float], v: Sequence[float]) -> list[float]:
        out = [0.0] * 12
        for i, wheels in enumerate(bogie.wheels):
            rails, at = table.under(i, t), 6 * i
            lateral, yaw = wheels.forces(rails, q[at + 1], v[at + 1], q[at + YAW], v[at + YAW])
            # the couple of the spinning wheels, whose roll rate is -sigma y'/b
            gyro = wheels.spin_inertia * rails.speed * wheels.roll / (wheels.half_gauge * wheels.radius)
            out[at + 1] = lateral + gyro * v[at + YAW]
            out[at + YAW] = yaw - gyro * v[at + 1]
        return out

    return forces
