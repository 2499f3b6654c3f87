"""Sensors of the demo logger: readings of a real bogie's sensors in a simulated run, with their noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.capture.protocol.messages import Channel
from railui.core import Spline
from railui.track.line_geometry import GRAVITY

# unit of each sensor, resolution of its 16 bits, standard deviation of its noise [both in that unit]
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
RANDOM_STREAM = 21  # separates the noise from other random numbers of the same seed


@dataclass(frozen=True)
class WheelsetGeometry:
    """Geometry of a bogie that its sensors depend on: a and b [m], roll coefficient sigma of both wheelsets."""

    half_wheelbase: float
    half_gauge: float
    roll: tuple[float, float]


def simulate_sensors(
    motion: Mapping[str, FloatArray], geometry: WheelsetGeometry, rate: float, seed: int, noise: float = 1.0
) -> dict[str, FloatArray]:
    """Compute the readings of the sensors.

    An accelerometer reads y'' - g phi, with the roll of its wheelset phi_w - sigma e/b; the frame rolls with the
    mean of both cross-levels. A rail sensor reads the position of its wheel on its rail: e -/+ g/2 (right, left).

    Parameters
    ----------
    motion
        s, v, phiw, gauge and the responses of the vehicle [n], in SI.
    geometry
        Geometry of the bogie.
    rate
        Sampling rate [Hz].
    seed
        Seed of the noise.
    noise
        Factor of the usual noise.

    Returns
    -------
    Readings [n] by channel, in the units of `SENSORS`.
    """
    s = motion["s"]
    b = geometry.half_gauge
    trailing = np.maximum(s - 2 * geometry.half_wheelbase, s[0])
    phiw2, gauge2 = (np.interp(trailing, s, motion[name]) for name in ("phiw", "gauge"))
    time = np.arange(s.size) / rate
    roll1 = motion["phiw"] - geometry.roll[0] * motion["e1"] / b
    roll2 = phiw2 - geometry.roll[1] * motion["e2"] / b
    clean = {
        "speed": motion["v"],
        "box1_y": motion["ay1"] - GRAVITY * roll1,
        "box2_y": motion["ay2"] - GRAVITY * roll2,
        "frame_y": motion["ayf"] - GRAVITY * 0.5 * (motion["phiw"] + phiw2),
        "frame_yaw": motion["rf"],
        "box1_roll": Spline(time, roll1)(time, 1),  # central differences are 1.6 % too small at 10 Hz
        "rail1_right": 1e3 * (motion["e1"] - motion["gauge"] / 2),
        "rail1_left": 1e3 * (motion["e1"] + motion["gauge"] / 2),
        "rail2_right": 1e3 * (motion["e2"] - gauge2 / 2),
        "rail2_left": 1e3 * (motion["e2"] + gauge2 / 2),
        "prim1": 1e3 * motion["d1"],
        "prim2": 1e3 * motion["d2"],
    }
    random = np.random.default_rng([seed, RANDOM_STREAM])
    return {name: clean[name] + noise * sd * random.standard_normal(s.size) for name, (_, _, sd) in SENSORS.items()}


def demo_channels() -> tuple[Channel, ...]:
    """Return the channels of the demo logger."""
    return tuple(Channel(name, unit, "h", step) for name, (unit, step, _) in SENSORS.items())
