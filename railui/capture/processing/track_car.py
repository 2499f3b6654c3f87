"""Recordings of track recording cars: their channels, and a track built of them."""

from __future__ import annotations

import numpy as np

from railui.arrays import FloatArray
from railui.capture.processing.recording import Recording, UniformSegment
from railui.capture.processing.sensor_map import SensorMap
from railui.capture.processing.sensors import check_channels, sensor_signals
from railui.io.problems import file_problem

MIN_ABSOLUTE_GAUGE = 0.5  # m; a smaller median is a deviation from the nominal gauge


def convert_track_channels(signals: dict[str, FloatArray], sensor_map: SensorMap) -> None:
    """Convert channels of track recording cars: alignment of both rails, cross-level as a height, absolute gauge."""
    right = signals.pop("alignment_right", None)
    left = signals.pop("alignment_left", None)
    sides = [x for x in (right, left) if x is not None]
    if sides and "yw" not in signals:
        signals["yw"] = np.asarray(np.mean(sides, axis=0))
    height = signals.pop("cross_level", None)
    if height is not None:
        signals.setdefault("phiw", height / sensor_map.cross_level_base)
    if "gauge" in signals and np.nanmedian(signals["gauge"]) > MIN_ABSOLUTE_GAUGE:
        signals["gauge"] = signals["gauge"] - sensor_map.nominal_gauge


def build_track_columns(recording: Recording, sensor_map: SensorMap) -> dict[str, FloatArray]:
    """Build the columns s, yw, phiw, gauge of a track recording car, equally spaced.

    Raises
    ------
    FileProblems
        If there is no alignment, or a row without a value.
    """
    check_channels(sensor_map, recording)
    whole = UniformSegment(recording.t, recording.interval, dict(recording.channels))
    signals = sensor_signals(sensor_map, recording, whole)
    convert_track_channels(signals, sensor_map)
    if "yw" not in signals:
        message = "no channel for the lateral deviation"
        remedy = "map alignment_right and alignment_left, or yw"
        raise file_problem(sensor_map.source, message, remedy, "sensors", position=(1, 1))
    # distances decrease where the car runs against the mileage; its right side remains the right one
    direction = 1.0 if recording.t[-1] > recording.t[0] else -1.0
    columns: dict[str, FloatArray] = {"s": direction * (recording.t - recording.t[0])}
    columns |= {name: signals[name] for name in ("yw", "phiw", "gauge") if name in signals}
    missing = {name: int(np.count_nonzero(~np.isfinite(x))) for name, x in columns.items()}
    if any(missing.values()):
        counts = ", ".join(f"{count} rows have no value of {name}" for name, count in missing.items() if count)
        reasons = "".join(f"; {note}" for note in recording.notes)
        raise file_problem(recording.sources[0], counts + reasons, "cut the track there")
    return columns
