"""Recordings to runs by a sensor map: signals, removal of gravity, reconstruction of the rails, checks, report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from railui.arrays import FloatArray
from railui.capture.processing.checks import (
    MAX_CORRECTED_DRIFT,
    disagreement_note,
    find_clipped,
    standstill_checks,
    time_base_notes,
)
from railui.capture.processing.map_schema import ACCELERATIONS
from railui.capture.processing.measured_run import MeasuredRun
from railui.capture.processing.rail_position import ReconstructedTrack, natural_frequency, reconstruct
from railui.capture.processing.rail_quality import RailQuality, compare_versions
from railui.capture.processing.recording import Recording, UniformSegment, uniform_segments
from railui.capture.processing.sensor_map import SensorMap
from railui.capture.processing.sensors import (
    COUNTER_PERIODS,
    MIN_SPEED,
    check_channels,
    column_noise,
    distance_and_speed,
    required_channels,
    sensor_signals,
    unit_notes,
    unmeasured_rows,
    without_impossible_speeds,
)
from railui.capture.processing.track_car import convert_track_channels
from railui.dsp.integrate import lowpass
from railui.io.problems import FileProblems, file_problem, join_names
from railui.runs.columns import COLUMNS, RIG_COLUMNS
from railui.runs.plausibility import CLIPPED_COMMENT
from railui.runs.segments import MIN_DURATION

MIN_RIG_DURATION = 0.05  # s
STANDSTILL = "at a standstill are ignored"  # end of a note
MAX_LAG = 0.25  # m between the reconstructions of both wheelsets
MIN_CORRELATION = 0.5  # between the reconstructions of both wheelsets
MAX_GYRO_FREQUENCY = 40.0  # Hz, above which the derivative of a gyro is noise
MAX_ARM_WITHOUT_GYRO = 0.05  # m


@dataclass(frozen=True, eq=False)
class _Moving:
    """Segment in which the vehicle moves, with distance s [m] and speed v [m/s], [n]."""

    segment: UniformSegment
    s: FloatArray
    v: FloatArray


@dataclass(frozen=True, eq=False)
class _TrackPart:
    """Reconstructed track of a segment, the rows that are kept, the distance [m] of all rows."""

    track: ReconstructedTrack
    rows: slice
    s: FloatArray


@dataclass(eq=False)
class _RunBuilder:
    """Parts of a run under construction."""

    recording: Recording
    sensor_map: SensorMap
    counts: dict[str, int]
    notes: list[str]
    raw: frozenset[str]  # accelerometers that measure gravity
    clipped: dict[str, str]  # extent of clipping by quantity
    columns: list[dict[str, FloatArray]] = field(default_factory=list)
    track_parts: list[_TrackPart] = field(default_factory=list)

    @property
    def time_scale(self) -> float:
        """Factor of the times: 1 + drift of the logger's clock, if it is plausible."""
        drift = self.recording.drift
        return 1.0 + drift if drift is not None and abs(drift) < MAX_CORRECTED_DRIFT else 1.0


def build_measured_run(recording: Recording, sensor_map: SensorMap) -> MeasuredRun:
    """Build the run of a recording.

    Raises
    ------
    FileProblems
        With everything that the map or the recording lacks.
    """
    check_channels(sensor_map, recording)
    names = required_channels(sensor_map, recording)
    if set(sensor_map.sensors) & set(RIG_COLUMNS):
        return _build_rig_run(recording, sensor_map, names)
    sensors = sensor_map.sensors
    raw = frozenset(n for n in ACCELERATIONS if n in sensors and sensors[n].gravity == "raw")
    _require_vehicle(sensor_map, raw)
    recording, speed_notes = without_impossible_speeds(sensor_map, recording)
    standstill, notes = standstill_checks(sensor_map, recording)
    notes += [*recording.notes, *unit_notes(sensor_map, recording), *speed_notes, *time_base_notes(recording)]
    segments, counts = uniform_segments(recording, names, MIN_DURATION)
    clipped = find_clipped(recording, sensor_map)
    notes += [CLIPPED_COMMENT + text for text in clipped.values()]
    builder = _RunBuilder(recording, sensor_map, counts, notes, raw, clipped)
    for moving in _moving_segments(builder, segments):
        _add_segment(builder, moving)
    if not builder.columns:
        standing = [f"{note}: v < {MIN_SPEED:g} m/s" for note in builder.notes if note.endswith(STANDSTILL)]
        causes = [*speed_notes, *_empty_channels(recording, names), *_falling_counter(sensor_map, recording), *standing]
        raise _too_short(recording, counts, causes)
    columns = _concatenate(builder.columns)
    quality, natural = _compare_wheelsets(builder)
    return MeasuredRun(
        columns={name: columns[name] for name in COLUMNS if name in columns},
        units={name: COLUMNS[name].unit for name in columns},
        noise=_noise(sensor_map, columns, quality, standstill),
        rail_quality=quality,
        counts=counts,
        natural_frequency=natural,
        standstill=standstill,
        notes=tuple(dict.fromkeys(builder.notes)),
    )


def _require_vehicle(sensor_map: SensorMap, raw: frozenset[str]) -> None:
    """Raise FileProblems if the map names no vehicle and its geometry is needed."""
    if sensor_map.geometry is not None:
        return
    if "yw" not in sensor_map.sensors:
        purpose = "the rail position"
    elif raw:
        purpose = f"the gravity in {', '.join(sorted(raw))}"
    else:
        return
    remedy = "add `vehicle: DESIGN.yaml`, which gives wheelbase, gauge, radius and roll"
    raise file_problem(sensor_map.source, f"is missing: {purpose} depends on it", remedy, "vehicle", position=(1, 1))


def _too_short(
    recording: Recording, counts: Mapping[str, int], causes: Sequence[str], duration: float = MIN_DURATION
) -> FileProblems:
    """Return the error of a recording without a segment of a duration [s], with its causes."""
    summary = f"{counts['rows']} rows, {counts['gaps']} gaps, {counts['short']} short segments"
    settling = ", and the settling time of the filter" if duration == MIN_DURATION else ""
    message = f"no segment is long enough ({summary}): {duration:g} s{settling}"
    message += "".join(f"; {cause}" for cause in dict.fromkeys(causes))
    source = str(recording.sources[0]) if recording.sources else recording.name
    return file_problem(source, message, "record longer without a gap, or map fewer channels")


def _empty_channels(recording: Recording, names: Sequence[str]) -> list[str]:
    """Return a sentence on the channels without a value, else on the one that lacks most."""
    missing = {name: int(np.count_nonzero(~np.isfinite(recording.channels[name]))) for name in names}
    empty = [name for name, count in missing.items() if count == recording.t.size]
    if empty:
        return [f"no row has a value of {join_names(empty)}"]
    worst = max(missing, key=lambda name: missing[name], default="")
    return [f"{missing[worst]} rows have no value of {worst}"] if missing.get(worst) else []


def _falling_counter(sensor_map: SensorMap, recording: Recording) -> list[str]:
    """Return a sentence on a counter of pulses that falls, at its first fall."""
    name = sensor_map.speed.pulses
    if name is None:
        return []
    count = recording.channels[name][np.isfinite(recording.channels[name])]
    first = np.flatnonzero(np.diff(count) < 0)[:1]
    wraps = ", ".join(map(str, COUNTER_PERIODS))
    return [f"the counter {name} falls from {count[k]:g} to {count[k + 1]:g}, it may wrap at {wraps}" for k in first]


def _noise(
    sensor_map: SensorMap,
    columns: Mapping[str, FloatArray],
    quality: RailQuality | None,
    standstill: Mapping[str, Mapping[str, float]],
) -> dict[str, float]:
    """Return the noise by column: stated, from the comparison of both wheelsets, from a standstill."""
    noise = column_noise(sensor_map, columns)
    if quality is not None and quality.noise is not None:
        noise.setdefault("yw", quality.noise)
    for name, statistics in standstill.items():
        if name in columns and statistics["sd"] > 0:
            noise.setdefault(name, statistics["sd"])
    return noise


def _moving_segments(builder: _RunBuilder, segments: list[UniformSegment]) -> Iterator[_Moving]:
    """Yield the parts of all segments in which the vehicle moves; an integrated distance continues over gaps."""
    start = 0.0
    end_time: float | None = None
    end_speed = 0.0
    for segment in segments:
        if end_time is not None:
            start += (segment.t[0] - end_time) * end_speed
        s, v = distance_and_speed(builder.sensor_map, builder.recording, segment, start)
        start, end_time, end_speed = float(s[-1]), float(segment.t[-1]), float(v[-1])
        yield from _moving_parts(builder, segment, s, v)


def _moving_parts(builder: _RunBuilder, segment: UniformSegment, s: FloatArray, v: FloatArray) -> Iterator[_Moving]:
    """Yield the parts of a segment in which the vehicle moves."""
    is_standing = np.concatenate(([True], v < MIN_SPEED, [True]))
    standing_time = float(np.count_nonzero(is_standing[1:-1]) * segment.dt)
    if standing_time:
        builder.notes.append(f"{standing_time:.0f} s {STANDSTILL}")
    for a, b in np.flatnonzero(np.diff(is_standing.astype(int))).reshape(-1, 2):
        if (b - a) * segment.dt < MIN_DURATION:
            builder.counts["short"] += 1
            continue
        rows = slice(int(a), int(b))
        channels = {name: x[rows] for name, x in segment.channels.items()}
        yield _Moving(replace(segment, t=segment.t[rows], channels=channels), s[rows], v[rows])


def _add_segment(builder: _RunBuilder, moving: _Moving) -> None:
    """Add the columns of a segment, with its reconstructed track if the map names a vehicle."""
    sensor_map = builder.sensor_map
    segment = moving.segment
    signals = sensor_signals(sensor_map, builder.recording, segment)
    _move_to_centre(signals, sensor_map, segment.dt, builder.notes)
    convert_track_channels(signals, sensor_map)
    base = {"t": segment.t * builder.time_scale, "s": moving.s, "v": moving.v}
    geometry = sensor_map.geometry
    first, last = unmeasured_rows(sensor_map, segment.dt)
    if (first or last) and (len(segment) - first - last) * segment.dt < MIN_DURATION:
        builder.counts["short"] += 1
        return
    builder.notes += _delay_notes(first, last)
    if geometry is None:
        rows = slice(first, len(segment) - last)
        builder.columns.append({n: x[rows] for n, x in (base | signals).items() if n in COLUMNS})
        return
    settling_time = 2 / natural_frequency(sensor_map.rails, float(moving.v.mean()))
    if (len(segment) - first - last) * segment.dt < MIN_DURATION + settling_time and "yw" not in signals:
        builder.counts["short"] += 1
        return
    try:
        track = reconstruct(signals, moving.s, segment.dt, sensor_map.rails, geometry, builder.raw)
    except ValueError as error:
        remedy = "map a sensor that measures it"
        raise file_problem(sensor_map.source, str(error), remedy, "sensors", position=(1, 1)) from None
    rows = slice(first + track.settling_samples, len(segment) - last - track.settling_samples)
    if builder.raw and track.has_roll:
        raw = ", ".join(sorted(builder.raw))
        builder.notes.append(f"gravity through roll is taken out of {raw} (gravity: raw in the map)")
    builder.notes += track.notes
    builder.track_parts.append(_TrackPart(track, rows, moving.s))
    builder.columns.append({n: x[rows] for n, x in (base | dict(track.columns)).items()})


def _delay_notes(first: int, last: int) -> list[str]:
    """Return a note on the rows at the ends of a segment that the delays leave without a value."""
    ends = [f"the {place} {count}" for place, count in (("first", first), ("last", last)) if count]
    return [f"{' and '.join(ends)} rows of each segment are left out: a delay leaves them no value"] if ends else []


def _move_to_centre(signals: dict[str, FloatArray], sensor_map: SensorMap, dt: float, notes: list[str]) -> None:
    """Transfer accelerations from the sensors to the centre of their body: y'' = y_s'' - x psi'' + z phi''."""
    for name, yaw, roll in (("ay1", "", "roll_rate1"), ("ay2", "", "roll_rate2"), ("ayf", "rf", "roll_ratef")):
        if name not in signals:
            continue
        x, _, z = sensor_map.sensors[name].position
        for arm, rate, sign in ((x, yaw, -1.0), (z, roll, 1.0)):
            if arm and rate in signals:
                acceleration = np.gradient(lowpass(signals[rate], dt, MAX_GYRO_FREQUENCY), dt)
                signals[name] = signals[name] + sign * arm * acceleration
            elif arm and (rate or abs(arm) > MAX_ARM_WITHOUT_GYRO):
                notes.append(f"{name} is mounted {arm:g} m off the centre, without a gyro there: not corrected")


def _compare_wheelsets(builder: _RunBuilder) -> tuple[RailQuality | None, float | None]:
    """Compare both wheelsets' reconstructions on the longest segment; return quality and natural frequency."""
    if not builder.track_parts:
        return None, None
    part = max(builder.track_parts, key=lambda p: p.rows.stop - p.rows.start)
    versions = part.track.versions
    natural = part.track.natural_frequency
    if len(versions) < 2:
        if not versions:
            return None, None
        builder.notes.append("the rail position comes from one wheelset alone: no comparison is possible")
        return None, natural
    first, second = (versions[i][part.rows] for i in (1, 2))
    rows = np.flatnonzero(np.isfinite(second))
    s = part.s[part.rows][rows]
    speed = float(np.ptp(s) / ((rows[-1] - rows[0]) * _sampling_interval(builder.columns)))
    shortest = builder.sensor_map.rails.shortest
    geometry = builder.sensor_map.geometry
    arm = geometry.rolling_radius if geometry is not None and not part.track.has_roll else None
    quality = compare_versions(first[rows], second[rows], s, shortest, natural, speed, arm)
    if quality.correlation < MIN_CORRELATION:
        builder.notes.append(disagreement_note(builder.clipped, quality))
    elif abs(quality.lag) > MAX_LAG:
        builder.notes.append(
            f"the delay of the trailing wheelset differs from 2a by {quality.lag:+.2f} m: check wheelbase, speed and "
            "clocks"
        )
    return quality, natural


def _sampling_interval(columns: list[dict[str, FloatArray]]) -> float:
    """Return the sampling interval [s] of the longest segment."""
    t = max(columns, key=lambda c: c["t"].size)["t"]
    return float((t[-1] - t[0]) / (t.size - 1))


def _concatenate(parts: list[dict[str, FloatArray]]) -> dict[str, FloatArray]:
    """Concatenate the columns that all parts have."""
    names = [n for n in parts[0] if all(n in part for part in parts)]
    return {name: np.concatenate([part[name] for part in parts]) for name in names}


def _build_rig_run(recording: Recording, sensor_map: SensorMap, names: tuple[str, ...]) -> MeasuredRun:
    """Build the run of a test rig: the mapped channels in their own units; gaps remain."""
    segments, counts = uniform_segments(recording, names, MIN_RIG_DURATION)
    if not segments:
        raise _too_short(recording, counts, _empty_channels(recording, names), MIN_RIG_DURATION)
    parts = []
    for segment in segments:
        first, last = unmeasured_rows(sensor_map, segment.dt)
        signals = {"t": segment.t, **sensor_signals(sensor_map, recording, segment)}
        parts.append({name: x[first : max(len(segment) - last, first)] for name, x in signals.items()})
    columns = _concatenate(parts)
    if not columns["t"].size:
        raise _too_short(recording, counts, _delay_notes(first, last), MIN_RIG_DURATION)
    units = {"t": "s"}
    for name in set(columns) - {"t"}:
        sensor = sensor_map.sensors[name]
        units[name] = sensor.unit or recording.units.get(sensor.channels[0]) or "1"
    return MeasuredRun(
        columns={name: columns[name] for name in RIG_COLUMNS if name in columns},
        units=units,
        noise={n: x for n, x in sensor_map.noise.items() if n in columns},
        rail_quality=None,
        counts=counts,
        natural_frequency=None,
        standstill={},
        notes=(
            *recording.notes,
            *unit_notes(sensor_map, recording),
            *_delay_notes(first, last),
            *(CLIPPED_COMMENT + x for x in find_clipped(recording, sensor_map).values()),
        ),
    )
