"""What a recording tells of its own sensors: gravity on the wrong axis, noise at a standstill, clocks that disagree."""

from __future__ import annotations

import numpy as np

from railui.arrays import FloatArray
from railui.capture.processing.map_model import ACCELERATIONS
from railui.capture.processing.recording import Piece, Recording, interval_of
from railui.capture.processing.sensor_map import SensorMap
from railui.capture.processing.sensors import motion, needed, quantities

STANDING = 0.1  # m/s
LONG_ENOUGH = 2.0  # s
TILTED = 3.0  # m/s^2: more than any cant gives a lateral accelerometer
DRIFT_TOLD, DRIFT_APPLIED = 1e-4, 1e-3  # from which a drift is told; up to which times are stretched by it
DRIFT_ABSURD = 0.01  # no clock, but a recording played at another pace


def standstill_checks(mapped: SensorMap, recording: Recording) -> tuple[dict[str, dict[str, float]], list[str]]:
    """Mean and standard deviation [SI] of every sensor while the vehicle stands, and what is odd about them.

    Standing: below 0.1 m/s for 2 s at least. An accelerometer that reads more than 3 m/s^2 there, or on the mean of
    the whole recording, sits on another axis than its map says.
    """
    names = needed(mapped, recording)
    rows = np.flatnonzero(np.all([np.isfinite(recording.channels[n]) for n in names], axis=0))
    if rows.size < 4:
        return {}, []
    whole = Piece(recording.t[rows], interval_of(recording.t), {n: recording.channels[n][rows] for n in names})
    q = quantities(mapped, recording, whole)
    notes = []
    for name in ACCELERATIONS:
        if name in q and abs(np.mean(q[name])) > TILTED:
            notes.append(
                f"{name} reads {np.mean(q[name]):+.2f} m/s^2 on the mean: gravity is on its axis, is that the vertical?"
            )
    standing = _standing(motion(mapped, recording, whole)[1], whole.dt)
    if not standing.any():
        return {}, notes
    found = {name: {"mean": float(x[standing].mean()), "sd": float(x[standing].std())} for name, x in q.items()}
    return found, notes


def _standing(v: FloatArray, dt: float) -> np.ndarray:
    """Rows within unbroken standstills that are long enough."""
    still = np.concatenate(([False], np.abs(v) < STANDING, [False]))
    edges = np.flatnonzero(np.diff(still.astype(int))).reshape(-1, 2)
    found = np.zeros(v.size, dtype=bool)
    for begin, end in edges:
        if (end - begin) * dt >= LONG_ENOUGH:
            found[begin:end] = True
    return found


def time_base_notes(recording: Recording) -> list[str]:
    """What is odd about the clock: drift against the machine that recorded, stamps that jitter."""
    notes = []
    drift = recording.drift
    if drift is not None and DRIFT_TOLD < abs(drift) < DRIFT_APPLIED:
        notes.append(f"the logger's clock is {1e6 * drift:+.0f} ppm off: its times are stretched by as much")
    elif drift is not None and abs(drift) >= DRIFT_ABSURD:
        notes.append(f"the logger ran {1 / (1 + drift):.3g} times as fast as the clock here: its own times are taken")
    elif drift is not None and abs(drift) >= DRIFT_APPLIED:
        notes.append(
            f"the logger's clock is {100 * drift:+.2f} % off, more than a quartz can be: its own times are taken"
        )
    steps = np.diff(recording.t)
    near = steps[np.abs(steps - recording.interval) < 0.5 * recording.interval]
    jitter = float(np.std(near)) / recording.interval if near.size else 0.0
    if jitter > 0.01:
        notes.append(f"time stamps jitter by {100 * jitter:.1f} % of the interval: laid anew at even ones")
    return notes
