"""Sensor signals: channels converted to SI with railui's signs and without delay; distance and speed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from railui.arrays import FloatArray
from railui.capture.processing.map_schema import QUANTITIES
from railui.capture.processing.recording import Recording, UniformSegment
from railui.capture.processing.sensor_map import Sensor, SensorMap
from railui.dsp.integrate import compensate_delay, lowpass
from railui.io.problems import Findings, suggest_name
from railui.io.units import MAX_SPEED, UnitError, convert
from railui.io.yaml_document import load_yaml
from railui.io.yaml_writer import scalar_text
from railui.runs.columns import RIG_COLUMNS

COUNTER_PERIODS = (1 << 8, 1 << 16, 1 << 32)  # at which counters of pulses wrap
SPEED_CORNER = 1.0  # Hz, above which the speed of a train does not change
MAX_HELD_TIME = 0.05  # s for which a delayed signal holds its last value at the end of a segment
MIN_SPEED = 1.0  # m/s, below which the vehicle stands; at a standstill a sensor may read as much below 0
SPEED_NAMES = ("v", "speed", "Speed", "velocity")


def check_channels(sensor_map: SensorMap, recording: Recording) -> None:
    """Raise FileProblems with every channel that the recording lacks and every unit that does not match."""
    findings = load_yaml(sensor_map.source).findings()
    for sensor in sensor_map.sensors.values():
        for channel in sensor.channels:
            _check_channel(sensor, channel, recording, findings)
    for key in ("channel", "distance", "pulses"):
        name = getattr(sensor_map.speed, key)
        if name is not None and name not in recording.channels:
            findings.add(f"speed.{key}", *_missing_channel(recording, name))
    if _lacks_speed(sensor_map, recording):
        findings.add(
            "speed", "the speed is not given", "add `speed: {channel: NAME}`, {pulses: ...} or {constant: ...}"
        )
    _check_speed_unit(sensor_map, recording, findings)
    findings.raise_errors()


def _check_speed_unit(sensor_map: SensorMap, recording: Recording, findings: Findings) -> None:
    """Report a channel of the speed without a unit, or with one of another quantity."""
    name = _speed_channel(sensor_map, recording) or ""
    if name not in recording.channels or not _is_vehicle_run(sensor_map, recording):
        return
    try:
        if not (sensor_map.speed.unit or recording.units.get(name)):
            remedy = f"write `speed: {{channel: {scalar_text(name)}, unit: m/s}}`, or the actual one"
            raise UnitError("has no unit", remedy)
        _speed_factor(sensor_map, recording, name)
    except UnitError as error:
        findings.add("speed.channel", f"{name}: {error.message}", error.remedy)


def _check_channel(sensor: Sensor, channel: str, recording: Recording, findings: Findings) -> None:
    key = f"sensors.{sensor.quantity}.channel"
    if channel not in recording.channels:
        findings.add(key, *_missing_channel(recording, channel))
        return
    try:
        unit_factor(sensor, recording.units.get(channel))
        channel_offset(sensor, recording.units.get(channel))
    except UnitError as error:
        findings.add(key, f"{channel}: {error.message}", error.remedy)


def _missing_channel(recording: Recording, name: str) -> tuple[str, str]:
    """Return message and remedy for a channel that a recording lacks; the message has the reason where it has one."""
    starts = tuple(f"{name} {verb} " for verb in ("has", "holds", "is"))
    reason = next((f": {note}" for note in recording.notes if note.startswith(starts)), "")
    return f"{recording.name} has no channel {name!r}{reason}", suggest_name(name, list(recording.channels))


def _lacks_speed(sensor_map: SensorMap, recording: Recording) -> bool:
    speed = sensor_map.speed
    is_given = speed.constant is not None or speed.pulses is not None
    is_missing = not is_given and _speed_channel(sensor_map, recording) is None
    return is_missing and _is_vehicle_run(sensor_map, recording)


def _is_vehicle_run(sensor_map: SensorMap, recording: Recording) -> bool:
    return recording.abscissa == "t" and not set(sensor_map.sensors) & set(RIG_COLUMNS)


def unit_factor(sensor: Sensor, unit: str | None) -> float:
    """Return the factor from a channel's unit to SI; raise UnitError if there is no unit or a wrong one."""
    stated = sensor.unit if sensor.unit is not None else unit
    if stated is None:
        wanted = QUANTITIES[sensor.quantity].unit
        raise UnitError("has no unit", f"add `unit: {wanted}`, or the actual one")
    return sensor.si_factor(stated or "1")


def channel_offset(sensor: Sensor, unit: str | None) -> float:
    """Return the offset in a channel's unit; raise UnitError if the two units do not match."""
    stated = sensor.unit if sensor.unit is not None else unit
    return sensor.offset_in(stated or "1")


def required_channels(sensor_map: SensorMap, recording: Recording) -> tuple[str, ...]:
    """Return the channels of a recording that a map uses."""
    channels = [c for s in sensor_map.sensors.values() for c in s.channels]
    speed = sensor_map.speed
    motion = [speed.distance, speed.pulses, _speed_channel(sensor_map, recording)]
    return tuple(dict.fromkeys([*channels, *(c for c in motion if c is not None)]))


def sensor_signals(sensor_map: SensorMap, recording: Recording, segment: UniformSegment) -> dict[str, FloatArray]:
    """Return the signals [n] by quantity in SI, with railui's signs and their delay compensated."""
    signals = {}
    for sensor in sensor_map.sensors.values():
        units = {c: recording.units.get(c) for c in sensor.channels}
        values = [(segment.channels[c] - channel_offset(sensor, u)) * unit_factor(sensor, u) for c, u in units.items()]
        mean = sensor.factor * np.asarray(np.mean(values, axis=0))
        signals[sensor.quantity] = compensate_delay(mean, segment.dt, sensor.delay)
    return signals


def unmeasured_rows(sensor_map: SensorMap, dt: float) -> tuple[int, int]:
    """Return the rows at the start and the end of a segment without a value of every sensor, because of the delays.

    A few rows that hold a value for up to MAX_HELD_TIME are kept.
    """
    delays = [sensor.delay for sensor in sensor_map.sensors.values()]
    first, last = max(0.0, -min(delays, default=0.0)), max(0.0, max(delays, default=0.0))
    start, end = (int(np.ceil(held / dt)) if held > MAX_HELD_TIME else 0 for held in (first, last))
    return start, end


def unit_notes(sensor_map: SensorMap, recording: Recording) -> list[str]:
    """Return a note on every channel of which the map states another unit than the file."""
    speed = _speed_channel(sensor_map, recording)
    stated = [(channel, sensor.unit) for sensor in sensor_map.sensors.values() for channel in sensor.channels]
    stated += [(speed, sensor_map.speed.unit)] if speed is not None else []
    pairs = [(channel, unit, recording.units.get(channel)) for channel, unit in stated]
    return [
        f"{channel}: the unit {unit} of the map is used instead of {other}, which the file states"
        for channel, unit, other in pairs
        if unit and other and not _is_same_unit(unit, other)
    ]


def _is_same_unit(unit: str, other: str) -> bool:
    try:
        return convert(1.0, unit, other) == 1.0
    except UnitError:
        return unit == other


def _speed_channel(sensor_map: SensorMap, recording: Recording) -> str | None:
    speed = sensor_map.speed
    if speed.channel is not None or speed.pulses or speed.constant:
        return speed.channel
    return next((name for name in SPEED_NAMES if name in recording.channels), None)


def without_impossible_speeds(sensor_map: SensorMap, recording: Recording) -> tuple[Recording, list[str]]:
    """Return a recording with gaps where its speed is none of a train, before any filter, and a note on them."""
    name = _speed_channel(sensor_map, recording)
    if name is None:
        return recording, []
    v = recording.channels[name] * _speed_factor(sensor_map, recording, name)
    is_impossible = (v < -MIN_SPEED) | (v > MAX_SPEED)
    if not is_impossible.any():
        return recording, []
    low, high = (float(limit(v[is_impossible])) for limit in (np.min, np.max))
    values = f"{low:.6g} m/s" if low == high else f"{low:.6g} to {high:.6g} m/s"
    count = np.count_nonzero(is_impossible)
    note = f"{name}: {count} rows of {values} are gaps: a speed is from 0 to {MAX_SPEED:g} m/s"
    x = np.where(is_impossible, np.nan, recording.channels[name])
    return replace(recording, channels={**recording.channels, name: x}), [note]


def _speed_factor(sensor_map: SensorMap, recording: Recording, name: str) -> float:
    """Return the factor of the channel of the speed to m/s; raise UnitError for another unit."""
    return convert(1.0, sensor_map.speed.unit or recording.units.get(name) or "m/s", "m/s")


def distance_and_speed(
    sensor_map: SensorMap, recording: Recording, segment: UniformSegment, start: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return distance [m] and speed [m/s] along a segment [n]; an integrated distance begins at `start` [m]."""
    speed = sensor_map.speed
    if speed.pulses is not None:
        metres_per_pulse = 2 * np.pi * (speed.radius or 0.0) / speed.per_turn
        return motion_from_pulses(segment.channels[speed.pulses], segment.dt, metres_per_pulse, start)
    name = _speed_channel(sensor_map, recording)
    if name is not None:
        v = segment.channels[name] * _speed_factor(sensor_map, recording, name)
        v = lowpass(v, segment.dt, SPEED_CORNER)
    else:
        v = np.full(len(segment), speed.constant or 0.0)
    if speed.distance is not None:
        unit = recording.units.get(speed.distance)
        return segment.channels[speed.distance] * convert(1.0, unit or "m", "m"), v
    return start + np.concatenate(([0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * segment.dt))), v


def motion_from_pulses(
    count: FloatArray, dt: float, metres_per_pulse: float, start: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return distance [m] and speed [m/s] from a counter of pulses [n] that may wrap at 2^8, 2^16 or 2^32.

    >>> s, v = motion_from_pulses(np.floor(np.arange(0, 600) * 4.0) % 256, 0.005, 0.05)
    >>> round(float(v[300]), 3), round(float(s[-1] - s[0]), 1)
    (40.0, 119.8)
    """
    steps = np.diff(count)
    period = next(p for p in COUNTER_PERIODS if np.max(count) < p)
    s = metres_per_pulse * np.concatenate(([0.0], np.cumsum(np.where(steps < 0, steps + period, steps))))
    line = np.linspace(s[0], s[-1], s.size)
    smooth = line + lowpass(s - line, dt, SPEED_CORNER)
    return start + smooth, np.gradient(smooth, dt)


def column_noise(sensor_map: SensorMap, columns: Mapping[str, object]) -> dict[str, float]:
    """Return the stated noise by column of a run.

    That of e_i and of yw may come from the sensors of both rails, that of phiw from a cross-level as a height.
    """
    stated = dict(sensor_map.noise)
    if "cross_level" in stated:
        stated.setdefault("phiw", stated["cross_level"] / sensor_map.cross_level_base)
    alignments = [x for x in (stated.get(f"alignment_{side}") for side in ("right", "left")) if x is not None]
    if alignments:
        stated.setdefault("yw", float(np.linalg.norm(alignments)) / len(alignments))
    for i in (1, 2):
        sides = [stated.get(f"e{i}_{side}") for side in ("right", "left")]
        known = [x for x in sides if x is not None]
        if f"e{i}" not in stated and len(known) == 2:
            stated[f"e{i}"] = float(np.hypot(known[0], known[1])) / 2
    return {name: x for name, x in stated.items() if name in columns}
