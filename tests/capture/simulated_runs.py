"""Simulated runs and the readings of sensors in them, computed once."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from railui.capture.processing.sensor_map import VehicleGeometry
from railui.capture.simulator.demo import WheelsetGeometry, simulate_sensors
from railui.ride_quality.evaluation import simulate
from railui.runs.columns import COMPARED_CHANNELS
from railui.track import Track, synthetic_track

Floats = NDArray[np.float64]
RATE = 200.0  # Hz
SETTLING_TIME = 6.0  # s
HOME = Path(__file__).parents[2]
BOGIE = HOME / "designs/test_bogie.yaml"
A, B, R, SIGMA = 1.28, 0.75, 0.46, (0.05, 0.05)  # of that bogie
WHEELS, GEOMETRY = WheelsetGeometry(A, B, SIGMA), VehicleGeometry(A, B, R, SIGMA)
T = np.arange(400) / RATE
SERIES = {"acc_y": np.sin(20 * T), "way": 0.01 * np.cos(3 * T)}
UNITS: dict[str, str | None] = {"acc_y": "m/s^2", "way": "mm"}


@cache
def simulated_motion(seconds: float = 40.0, speed: float = 40.0, seed: int = 5) -> dict[str, Floats]:
    """Simulate a run on erri_b176_high: t, s, v, yw, phiw, gauge and the responses."""
    length, spacing = speed * (seconds + SETTLING_TIME), speed / RATE
    track = synthetic_track("erri_b176_high", length=length, seed=seed, spacing=spacing)
    # the family has no gauge deviation: a third of the lateral deviation of another seed
    gauge = synthetic_track("erri_b176_high", length=length, seed=seed + 100, spacing=spacing).yw / 3
    responses = simulate(str(BOGIE), Track(track.s, track.yw, track.phiw, gauge), speed, COMPARED_CHANNELS)
    columns = {
        **responses,
        "v": np.full(responses["t"].size, speed),
        "yw": track.yw,
        "phiw": track.phiw,
        "gauge": gauge,
    }
    return {name: x[round(SETTLING_TIME * RATE) :] for name, x in columns.items()}


def sensor_readings(columns: dict[str, Floats], noise: float = 0.05, seed: int = 1) -> dict[str, Floats]:
    """Return readings by quantity in SI; accelerometers with `noise` [m/s^2], the others in proportion."""
    s = simulate_sensors(columns, WHEELS, RATE, seed, noise / 0.05)
    sides = {f"e{i}_{j}": 1e-3 * s[f"rail{i}_{j}"] for i in (1, 2) for j in ("right", "left")}
    known = {"ay1": s["box1_y"], "ay2": s["box2_y"], "ayf": s["frame_y"], "rf": s["frame_yaw"]}
    return {**known, "roll_rate1": s["box1_roll"], **sides, "d1": 1e-3 * s["prim1"], "d2": 1e-3 * s["prim2"]}


def write_map(tmp_path: Path, text: str) -> Path:
    """Write a sensor map that names the bogie."""
    path = tmp_path / "map.yaml"
    path.write_text(f"vehicle: {BOGIE}\n{text}")
    return path
