"""The sensors of the demo logger: what a real bogie's would read of a simulated ride, with their noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.capture.protocol.frames import Channel
from railui.vehicle.wheel_loads import GRAVITY

# what each sensor reads, its unit, the resolution of its 16 bits and its noise [SI of the unit]
SENSORS: dict[str, tuple[str, float, float]] = {
    "speed": ("m/s", 0.002, 0.005),
    "box1_y": ("m/s^2", 0.004, 0.05),
    "box2_y": ("m/s^2", 0.004, 0.05),
    "frame_y": ("m/s^2", 0.002, 0.02),
    "frame_yaw": ("rad/s", 1e-5, 3e-4),
    "box1_roll": ("rad/s", 1e-5, 3e-4),
    "rail1_right": ("mm", 0.001, 0.05),
    "rail1_left": ("mm", 0.001, 0.05),
    "rail2_right": ("mm", 0.001, 0.05),
    "rail2_left": ("mm", 0.001, 0.05),
    "prim1": ("mm", 0.0005, 0.02),
    "prim2": ("mm", 0.0005, 0.02),
}


@dataclass(frozen=True)
class Wheels:
    """Of a vehicle, what its sensors depend on: wheelbase 2a and half gauge b [m], roll sigma of both wheelsets."""

    half_wheelbase: float
    half_gauge: float
    roll: tuple[float, float]


def sensed(
    ride: Mapping[str, FloatArray], wheels: Wheels, rate: float, seed: int, noise: float = 1.0
) -> dict[str, FloatArray]:
    """The sensors' series by channel; `ride` holds s, v, phiw, gauge and the responses in SI, `rate` samples per s.

    An accelerometer reads y'' - g phi, with the roll of its wheelset phi_w - sigma e/b; the frame rolls with the
    mean of both cross-levels. A rail sensor reads where its wheel stands on its rail: e -/+ g/2 (right, left).
    """
    s, b = ride["s"], wheels.half_gauge
    behind = np.maximum(s - 2 * wheels.half_wheelbase, s[0])
    phiw2, gauge2 = (np.interp(behind, s, ride[name]) for name in ("phiw", "gauge"))
    roll1 = ride["phiw"] - wheels.roll[0] * ride["e1"] / b
    roll2 = phiw2 - wheels.roll[1] * ride["e2"] / b
    clean = {
        "speed": ride["v"],
        "box1_y": ride["ay1"] - GRAVITY * roll1,
        "box2_y": ride["ay2"] - GRAVITY * roll2,
        "frame_y": ride["ayf"] - GRAVITY * 0.5 * (ride["phiw"] + phiw2),
        "frame_yaw": ride["rf"],
        "box1_roll": np.gradient(roll1, 1.0 / rate),
        "rail1_right": 1e3 * (ride["e1"] - ride["gauge"] / 2),
        "rail1_left": 1e3 * (ride["e1"] + ride["gauge"] / 2),
        "rail2_right": 1e3 * (ride["e2"] - gauge2 / 2),
        "rail2_left": 1e3 * (ride["e2"] + gauge2 / 2),
        "prim1": 1e3 * ride["d1"],
        "prim2": 1e3 * ride["d2"],
    }
    random = np.random.default_rng([seed, 21])
    return {name: clean[name] + noise * sd * random.standard_normal(s.size) for name, (_, _, sd) in SENSORS.items()}


def channels() -> tuple[Channel, ...]:
    """The channels of the demo logger."""
    return tuple(Channel(name, unit, "h", step) for name, (unit, step, _) in SENSORS.items())
