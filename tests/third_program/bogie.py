"""A bogie of two wheelsets under a carbody that stands still, of Exudyn's bodies and connectors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from exudyn import OutputVariableType as Output
from numpy.typing import NDArray

from tests.third_program.contact import Wheels
from tests.third_program.road import Road, Run
from tests.third_program.scene import G, PITCH, ROLL, YAW, Forces, Law, Scene
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
class Missing:
    """Effects beside the linear vehicle, by Exudyn's own friction or by laws across the primary suspension."""

    friction: tuple[float, float] | None = None  # dry friction of the secondary [N], linear below this speed [m/s]
    primary: Law | None = None  # of each axle box


NOTHING = Missing()


def simulate(bogie: Bogie, run: Run, missing: Missing = NOTHING, per_sample: int = 4) -> dict[str, Floats]:
    """Channels of the bogie along a run, from rest."""
    scene, a, height = Scene(), bogie.half_wheelbase, bogie.wheels[0].radius
    road = Road(run, (0.0, 2 * a), per_sample)
    sensors = Sensors(scene, road)
    frame = scene.body(bogie.frame_mass, (bogie.frame_roll, bogie.frame_pitch, bogie.frame_inertia), 0.0, height)
    carried = sum(2 * w.load for w in bogie.wheels) - 2 * bogie.wheelset_mass * G
    scene.weigh(frame, carried - bogie.frame_mass * G)
    k, c = (bogie.longitudinal, bogie.lateral, bogie.vertical[0]), (0.0, 0.0, bogie.vertical[1])
    wheelsets = []
    for i, x in enumerate((a, -a)):
        wheelset = scene.body(bogie.wheelset_mass, (bogie.wheelset_inertia,) * 3, x, height)
        # the wheelset of the plain bogie: its roll is that of the law of contact, not a motion
        scene.hold(wheelset, 0, 2, ROLL, PITCH)
        sides = [(x, y, height) for y in (bogie.half_base, -bogie.half_base)]
        boxes = [scene.upright(wheelset, frame, at, k, c, carried / 4, missing.primary) for at in sides]
        sensors.wheelset(i, wheelset, boxes, Output.Displacement)
        wheelsets.append(wheelset)
    k_y, c_y = bogie.secondary_lateral
    scene.upright(scene.ground, frame, (0.0, 0.0, height), (0.0, k_y, 0.0), (0.0, c_y, 0.0))
    scene.turning(scene.ground, frame, *bogie.secondary_yaw)
    if missing.friction is not None:
        scene.rubbing(frame, 1, *missing.friction)
    scene.act(wheelsets, _rails(bogie, road))
    sensors.acceleration("ayf", frame)
    sensors.yaw_rate("rf", frame)
    scene.march(road.step, road.steps, per_sample)
    return sensors.read()


def _rails(bogie: Bogie, road: Road) -> Forces:
    def forces(t: float, q: Sequence[float], v: Sequence[float]) -> list[float]:
        out = [0.0] * 12
        for i, wheels in enumerate(bogie.wheels):
            rails, at = road.under(i, t), 6 * i
            lateral, yaw = wheels.forces(rails, q[at + 1], v[at + 1], q[at + YAW], v[at + YAW])
            # the couple of the spinning wheels, whose roll rate is -sigma y'/b
            gyro = wheels.spin_inertia * rails.speed * wheels.roll / (wheels.half_gauge * wheels.radius)
            out[at + 1] = lateral + gyro * v[at + YAW]
            out[at + YAW] = yaw - gyro * v[at + 1]
        return out

    return forces
