"""Channels to what the sensors mean: SI, railui's signs, lags mended, distance and speed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from railui.arrays import FloatArray
from railui.capture.processing.map_model import TARGETS
from railui.capture.processing.recording import Piece, Recording
from railui.capture.processing.sensor_map import Sensor, SensorMap
from railui.dsp.integrate import delay, lowpass
from railui.io.problems import nearest
from railui.io.units import UnitError, convert
from railui.io.yaml_document import load
from railui.runs.columns import RIG_COLUMNS

WRAPS = (1 << 8, 1 << 16, 1 << 32)  # where counters of pulses begin again
SMOOTH = 1.0  # Hz, above which a train's speed does not change


def check_channels(mapped: SensorMap, recording: Recording) -> None:
    """Raises FileProblems that name every channel that is not there and every unit that does not fit."""
    findings = load(mapped.source).findings()
    known = list(recording.channels)
    for sensor in mapped.sensors.values():
        path = f"sensors.{sensor.target}"
        for channel in sensor.channels:
            if channel not in recording.channels:
                findings.add(f"{path}.channel", f"{recording.name} has no channel {channel!r}", nearest(channel, known))
                continue
            try:
                unit_factor(sensor, recording.units.get(channel))
            except UnitError as error:
                findings.add(f"{path}.channel", f"{channel}: {error.message}", error.remedy)
    speed = mapped.speed
    for key in ("channel", "distance", "pulses"):
        named = getattr(speed, key)
        if named is not None and named not in recording.channels:
            findings.add(f"speed.{key}", f"{recording.name} has no channel {named!r}", nearest(named, known))
    if (
        recording.against == "t"
        and not set(mapped.sensors) & set(RIG_COLUMNS)
        and speed.constant is None
        and speed.pulses is None
        and _speed_channel(mapped, recording) is None
    ):
        findings.add(
            "speed", "nothing tells the speed", "add `speed: {channel: NAME}`, {pulses: ...} or {constant: ...}"
        )
    findings.stop()


def unit_factor(sensor: Sensor, unit: str | None) -> float:
    """What turns a channel's numbers into SI; UnitError where nobody says the unit, or it does not fit."""
    said = sensor.unit if sensor.unit is not None else unit
    if said is None:
        wanted = TARGETS[sensor.target].unit
        raise UnitError("has no unit", f"add `unit: {wanted}`, or what it is")
    return sensor.si(said or "1")


def needed(mapped: SensorMap, recording: Recording) -> tuple[str, ...]:
    """The channels that a map takes of a recording."""
    named = [c for s in mapped.sensors.values() for c in s.channels]
    speed = [mapped.speed.distance, mapped.speed.pulses, _speed_channel(mapped, recording)]
    return tuple(dict.fromkeys([*named, *(c for c in speed if c is not None)]))


def quantities(mapped: SensorMap, recording: Recording, piece: Piece) -> dict[str, FloatArray]:
    """What every sensor read, [n] by target, in SI with railui's signs and its lag mended."""
    found = {}
    for sensor in mapped.sensors.values():
        each = [
            (piece.channels[c] - sensor.offset) * unit_factor(sensor, recording.units.get(c)) for c in sensor.channels
        ]
        mean = np.mean(each, axis=0)
        found[sensor.target] = delay(sensor.factor * np.asarray(mean), piece.dt, sensor.delay)
    return found


def _speed_channel(mapped: SensorMap, recording: Recording) -> str | None:
    if mapped.speed.channel is not None or mapped.speed.pulses or mapped.speed.constant:
        return mapped.speed.channel
    for name in ("v", "speed", "Speed", "velocity"):
        if name in recording.channels:
            return name
    return None


def motion(mapped: SensorMap, recording: Recording, piece: Piece, begins: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Distance [m] and speed [m/s] along a piece; the distance goes on from `begins` where none is measured."""
    speed = mapped.speed
    if speed.pulses is not None:
        return pulses(
            piece.channels[speed.pulses], piece.dt, 2 * np.pi * (speed.radius or 0.0) / speed.per_turn, begins
        )
    name = _speed_channel(mapped, recording)
    if name is not None:
        unit = speed.unit or recording.units.get(name)
        v = piece.channels[name] * convert(1.0, unit or "m/s", "m/s")
        v = lowpass(v, piece.dt, SMOOTH)
    else:
        v = np.full(len(piece), speed.constant or 0.0)
    if speed.distance is not None:
        unit = recording.units.get(speed.distance)
        return piece.channels[speed.distance] * convert(1.0, unit or "m", "m"), v
    return begins + np.concatenate(([0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * piece.dt))), v


def pulses(count: FloatArray, dt: float, per_pulse: float, begins: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Distance [m] and speed [m/s] from a counter of pulses that may begin again at 2^8, 2^16 or 2^32.

    >>> s, v = pulses(np.floor(np.arange(0, 600) * 4.0) % 256, 0.005, 0.05)
    >>> round(float(v[300]), 3), round(float(s[-1] - s[0]), 1)
    (40.0, 119.8)
    """
    steps = np.diff(count)
    wrap = next(w for w in WRAPS if np.max(count) < w)
    s = per_pulse * np.concatenate(([0.0], np.cumsum(np.where(steps < 0, steps + wrap, steps))))
    straight = np.linspace(s[0], s[-1], s.size)
    smooth = straight + lowpass(s - straight, dt, SMOOTH)
    return begins + smooth, np.gradient(smooth, dt)


def noise_of(mapped: SensorMap, columns: Mapping[str, object]) -> dict[str, float]:
    """Stated noise by column of a run; of e from the sensors on both rails."""
    stated = dict(mapped.noise)
    for i in (1, 2):
        sides = [stated.get(f"e{i}_{side}") for side in ("right", "left")]
        known = [x for x in sides if x is not None]
        if f"e{i}" not in stated and len(known) == 2:
            stated[f"e{i}"] = float(np.hypot(known[0], known[1])) / 2
    return {name: x for name, x in stated.items() if name in columns}
