"""Checks of a recording's sensors: gravity on the wrong axis, noise at a standstill, errors of the clock."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.capture.processing.map_schema import ACCELERATIONS
from railui.capture.processing.rail_quality import RailQuality
from railui.capture.processing.recording import Recording, UniformSegment, sampling_interval
from railui.capture.processing.sensor_map import SensorMap
from railui.capture.processing.sensors import distance_and_speed, required_channels, sensor_signals
from railui.runs.clipping import clipped_samples

MAX_STANDSTILL_SPEED = 0.1  # m/s
MIN_STANDSTILL_DURATION = 2.0  # s
MAX_MEAN_ACCELERATION = 3.0  # m/s^2 of a lateral accelerometer: more than any cant causes
MIN_REPORTED_DRIFT = 1e-4
MAX_CORRECTED_DRIFT = 1e-3
MIN_REPLAY_DRIFT = 0.01  # not a clock error: the recording was played at another pace
MAX_JITTER = 0.01  # of the sampling interval
MIN_ROWS = 4
RAIL_SENSORS = ("ay1", "ay2", *(f"e{i}{side}" for i in (1, 2) for side in ("", "_right", "_left")))


def standstill_checks(sensor_map: SensorMap, recording: Recording) -> tuple[dict[str, dict[str, float]], list[str]]:
    """Compute mean and standard deviation [SI] of every sensor at a standstill, and check the accelerometers.

    Standstill: below 0.1 m/s for at least 2 s. An accelerometer with a mean of more than 3 m/s^2 over the whole
    recording is mounted along another axis than the map states.

    Returns
    -------
    "mean" and "sd" by sensor (empty without a standstill), and notes.
    """
    names = required_channels(sensor_map, recording)
    rows = np.flatnonzero(np.all([np.isfinite(recording.channels[n]) for n in names], axis=0))
    if rows.size < MIN_ROWS:
        return {}, []
    channels = {n: recording.channels[n][rows] for n in names}
    whole = UniformSegment(recording.t[rows], sampling_interval(recording.t), channels)
    signals = sensor_signals(sensor_map, recording, whole)
    notes = [
        f"{name} has a mean of {np.mean(signals[name]):+.2f} m/s^2: gravity is on its axis, is that the vertical?"
        for name in ACCELERATIONS
        if name in signals and abs(np.mean(signals[name])) > MAX_MEAN_ACCELERATION
    ]
    is_standing = _standstill_rows(distance_and_speed(sensor_map, recording, whole)[1], whole.dt)
    if not is_standing.any():
        return {}, notes
    standstill = {
        name: {"mean": float(x[is_standing].mean()), "sd": float(x[is_standing].std())} for name, x in signals.items()
    }
    return standstill, notes


def _standstill_rows(v: FloatArray, dt: float) -> NDArray[np.bool_]:
    """Return a mask of the rows within standstills of sufficient duration."""
    is_slow = np.concatenate(([False], np.abs(v) < MAX_STANDSTILL_SPEED, [False]))
    edges = np.flatnonzero(np.diff(is_slow.astype(int))).reshape(-1, 2)
    mask = np.zeros(v.size, dtype=bool)
    for begin, end in edges:
        if (end - begin) * dt >= MIN_STANDSTILL_DURATION:
            mask[begin:end] = True
    return mask


def time_base_notes(recording: Recording) -> list[str]:
    """Return notes on the clock: drift against the recording machine, jitter of the time stamps."""
    notes = []
    drift = recording.drift or 0.0
    if abs(drift) >= MIN_REPLAY_DRIFT:
        notes.append(f"the logger ran {1 / (1 + drift):.3g} times as fast as the host's clock: its own times are used")
    elif abs(drift) >= MAX_CORRECTED_DRIFT:
        notes.append(
            f"the logger's clock is off by {100 * drift:+.2f} %, more than a quartz can be: its own times are used"
        )
    elif abs(drift) > MIN_REPORTED_DRIFT:
        notes.append(f"the logger's clock is off by {1e6 * drift:+.0f} ppm: its times are corrected")
    steps = np.diff(recording.t)
    regular = steps[np.abs(steps - recording.interval) < 0.5 * recording.interval]
    jitter = float(np.std(regular)) / recording.interval if regular.size else 0.0
    if jitter > MAX_JITTER:
        notes.append(f"time stamps jitter by {100 * jitter:.1f} % of the interval: resampled at even times")
    return notes


def disagreement_note(clipped_quantities: Mapping[str, str], quality: RailQuality) -> str:
    """Return the likely cause why the reconstructions of both wheelsets disagree."""
    disagree = f"the two wheelsets measure different rails (correlation {quality.correlation:.2f})"
    clipped = [name for name in RAIL_SENSORS if name in clipped_quantities]
    if clipped:
        return f"{disagree}: {', '.join(clipped)} {'is' if len(clipped) == 1 else 'are'} clipped, widen the range"
    agreeing = [f"{low:g} to {high:g} m" for low, high, sd, difference in quality.bands if 0.5 * difference < 0.5 * sd]
    if agreeing:
        return (
            f"{disagree}, but agree from {', '.join(agreeing)}: the noise of the accelerometers exceeds longer waves "
            "at this speed; set `rails: {longest: ...}`"
        )
    return f"{disagree}: check the signs and axes of ay1, ay2, e1, e2"


def find_clipped(recording: Recording, sensor_map: SensorMap) -> dict[str, str]:
    """Return the extent of clipping by quantity, of the channels as they were recorded."""
    found = {}
    for name, sensor in sensor_map.sensors.items():
        for channel in sensor.channels:
            clipped = clipped_samples(recording.channels[channel])
            if clipped is not None:
                share = 100 * clipped[0] / recording.t.size
                unit = sensor.unit or recording.units.get(channel) or ""
                found[name] = f"{name} at {clipped[1]:.4g} {unit} in {clipped[0]} samples ({share:.2g} %)"
    return found
