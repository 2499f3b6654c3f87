"""A recording through its map to a run: mapped, freed of gravity, rails reconstructed, checked, and told of."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.capture.processing.checks import DRIFT_APPLIED, standstill_checks, time_base_notes
from railui.capture.processing.map_model import ACCELERATIONS
from railui.capture.processing.rail_position import Rails, natural_frequency, reconstruct
from railui.capture.processing.rail_quality import RailQuality, compare
from railui.capture.processing.recording import Piece, Recording, pieces
from railui.capture.processing.sensor_map import SensorMap
from railui.capture.processing.sensors import check_channels, motion, needed, noise_of, quantities
from railui.dsp.integrate import lowpass
from railui.io.problems import FileProblems, one_problem
from railui.io.table import write_table
from railui.runs.columns import COLUMNS, RIG_COLUMNS

SHORTEST = 10.0  # s: of a stretch that anything is adjusted to
SHORTEST_RIG = 0.05
SLOWEST = 1.0  # m/s, below which a vehicle stands
LATE = 0.25  # m by which the trailing wheelset's version may be off before that is told
FASTEST_TURN = 40.0  # Hz, above which the derivative of a gyro is noise


@dataclass(frozen=True, eq=False)
class MeasuredRun:
    """Columns [n] of a run by name, their units, stated noise, the quality of the track, everything to be told."""

    columns: Mapping[str, FloatArray]
    units: Mapping[str, str]
    noise: Mapping[str, float]
    quality: RailQuality | None
    counts: Mapping[str, int]
    natural: float | None
    standstill: Mapping[str, Mapping[str, float]]
    notes: tuple[str, ...]

    def report(self) -> dict[str, Any]:
        """The same for JSON."""
        q = self.quality
        return {
            "columns": list(self.columns),
            "rows": int(self.columns["t"].size) if "t" in self.columns else 0,
            "counts": dict(self.counts),
            "noise": dict(self.noise),
            "standstill": {name: dict(x) for name, x in self.standstill.items()},
            "natural_frequency": self.natural,
            "rails": None if q is None else {
                "bands": [{"from": a, "to": b, "sd_yw": sd, "difference": d} for a, b, sd, d in q.bands],
                "correlation": q.correlation,
                "lag": q.lag,
                "valid": None if q.valid is None else list(q.valid),
                "coherence": {"wavelength": q.wavelength, "value": q.coherence},
            },
            "notes": list(self.notes),
        }  # fmt: skip


@dataclass(eq=False)
class _Gathered:
    """Pieces as they are done."""

    columns: list[dict[str, FloatArray]] = field(default_factory=list)
    rails: list[tuple[Rails, slice, FloatArray]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def measured_run(recording: Recording, mapped: SensorMap) -> MeasuredRun:
    """The run of a recording. FileProblems that name what the map or the recording lacks, all at once."""
    check_channels(mapped, recording)
    names = needed(mapped, recording)
    if set(mapped.sensors) & set(RIG_COLUMNS):
        return _rig_run(recording, mapped, names)
    raw = frozenset(n for n in ACCELERATIONS if n in mapped.sensors and mapped.sensors[n].gravity == "raw")
    _needs_vehicle(mapped, raw)
    standstill, notes = standstill_checks(mapped, recording)
    notes += [*recording.notes, *time_base_notes(recording)]
    found, counts = pieces(recording, names, SHORTEST)
    stretch = 1.0 + recording.drift if recording.drift is not None and abs(recording.drift) < DRIFT_APPLIED else 1.0
    gathered, at, until = _Gathered(notes=notes), 0.0, None
    for piece in found:
        s, v = motion(mapped, recording, piece, at if until is None else at + (piece.t[0] - until[0]) * until[1])
        at, until = float(s[-1]), (float(piece.t[-1]), float(v[-1]))
        for part, way in _moving(piece, s, v, gathered, counts):
            _one_piece(recording, mapped, part, way, raw, stretch, gathered, counts)
    if not gathered.columns:
        raise _too_short(recording, counts)
    columns = _concatenated(gathered.columns)
    quality, natural = _quality(mapped, gathered)
    noise = noise_of(mapped, columns)
    if quality is not None and quality.noise is not None:
        noise.setdefault("yw", quality.noise)
    for name, told in standstill.items():
        if name in columns and told["sd"] > 0:
            noise.setdefault(name, told["sd"])
    units = {name: COLUMNS[name].unit for name in columns}
    ordered = {name: columns[name] for name in COLUMNS if name in columns}
    return MeasuredRun(
        ordered, units, noise, quality, counts, natural, standstill, tuple(dict.fromkeys(gathered.notes))
    )


def _moving(
    piece: Piece, s: FloatArray, v: FloatArray, gathered: _Gathered, counts: dict[str, int]
) -> Iterator[tuple[Piece, tuple[FloatArray, FloatArray]]]:
    """The parts of a piece in which the vehicle runs, with their distance [m] and speed [m/s]."""
    still = np.concatenate(([True], v < SLOWEST, [True]))
    standing = float(np.count_nonzero(still[1:-1]) * piece.dt)
    if standing:
        gathered.notes.append(f"{standing:.0f} s at a standstill are left out")
    for a, b in np.flatnonzero(np.diff(still.astype(int))).reshape(-1, 2):
        if (b - a) * piece.dt < SHORTEST:
            counts["short"] += 1
            continue
        rows = slice(int(a), int(b))
        channels = {name: x[rows] for name, x in piece.channels.items()}
        yield replace(piece, t=piece.t[rows], channels=channels), (s[rows], v[rows])


def _needs_vehicle(mapped: SensorMap, raw: frozenset[str]) -> None:
    if mapped.geometry is None and ("yw" not in mapped.sensors or raw):
        why = "the rail position" if "yw" not in mapped.sensors else f"the gravity in {', '.join(sorted(raw))}"
        remedy = "add `vehicle: DESIGN.yaml`, whose wheelbase, gauge, radius and roll are taken"
        raise one_problem(mapped.source, f"is missing: {why} depends on it", remedy, "vehicle", place=(1, 1))


def _too_short(recording: Recording, counts: Mapping[str, int]) -> FileProblems:
    told = f"{counts['rows']} rows, {counts['gaps']} gaps, {counts['short']} short pieces"
    message = f"no piece is long enough ({told}): {SHORTEST:g} s, and what the filter takes at both ends"
    source = str(recording.sources[0]) if recording.sources else recording.name
    return one_problem(source, message, "record longer without a gap, or map fewer channels")


def _one_piece(
    recording: Recording, mapped: SensorMap, piece: Piece, way: tuple[FloatArray, FloatArray], raw: frozenset[str],
    stretch: float, gathered: _Gathered, counts: dict[str, int],
) -> None:  # fmt: skip
    s, v = way
    q = quantities(mapped, recording, piece)
    _to_the_middle(q, mapped, piece.dt, gathered.notes)
    _car_channels(q, mapped)
    base = {"t": piece.t * stretch, "s": s, "v": v}
    geometry = mapped.geometry
    if geometry is None:
        gathered.columns.append(base | {n: x for n, x in q.items() if n in COLUMNS})
        return
    if len(piece) * piece.dt < SHORTEST + 2 / natural_frequency(mapped.rails, float(v.mean())) and "yw" not in q:
        counts["short"] += 1
        return
    try:
        rails = reconstruct(q, s, piece.dt, mapped.rails, geometry, raw)
    except ValueError as error:
        remedy = "map what tells it"
        raise one_problem(mapped.source, str(error), remedy, "sensors", place=(1, 1)) from None
    keep = slice(rails.settle, len(piece) - rails.settle)
    gathered.notes += rails.notes
    gathered.rails.append((rails, keep, s))
    gathered.columns.append({n: x[keep] for n, x in (base | dict(rails.columns)).items()})


def _to_the_middle(q: dict[str, FloatArray], mapped: SensorMap, dt: float, notes: list[str]) -> None:
    """Accelerometers from where they sit to the middle of their body: y'' = y_s'' - x psi'' + z phi''."""
    for name, yaw, roll in (("ay1", "", "roll_rate1"), ("ay2", "", "roll_rate2"), ("ayf", "rf", "roll_ratef")):
        if name not in q:
            continue
        x, _, z = mapped.sensors[name].position
        for arm, turn, sign in ((x, yaw, -1.0), (z, roll, 1.0)):
            if arm and turn in q:
                q[name] = q[name] + sign * arm * np.gradient(lowpass(q[turn], dt, FASTEST_TURN), dt)
            elif arm and (turn or abs(arm) > 0.05):
                notes.append(f"{name} sits {arm:g} m off: nothing tells its turning there, left as it is")


def _car_channels(q: dict[str, FloatArray], mapped: SensorMap) -> None:
    """Channels of recording cars: both rails' alignment, cross-level as a height, gauge as it is."""
    right, left = q.pop("alignment_right", None), q.pop("alignment_left", None)
    sides = [x for x in (right, left) if x is not None]
    if sides and "yw" not in q:
        q["yw"] = np.asarray(np.mean(sides, axis=0))
    height = q.pop("cross_level", None)
    if height is not None:
        q.setdefault("phiw", height / mapped.cross_level_base)
    if "gauge" in q and np.nanmedian(q["gauge"]) > 0.5:
        q["gauge"] = q["gauge"] - mapped.nominal_gauge


def _quality(mapped: SensorMap, gathered: _Gathered) -> tuple[RailQuality | None, float | None]:
    """The comparison of both wheelsets' versions on the longest piece."""
    if not gathered.rails:
        return None, None
    rails, keep, s = max(gathered.rails, key=lambda x: x[1].stop - x[1].start)
    if len(rails.versions) < 2:
        if rails.versions:
            gathered.notes.append("one wheelset alone tells the rail position: nothing to compare it with")
        return None, rails.natural if rails.versions else None
    both = np.flatnonzero(np.isfinite(rails.versions[2][keep]))
    place = s[keep][both]
    speed = float(np.ptp(place) / ((both[-1] - both[0]) * _interval(gathered.columns)))
    quality = compare(
        rails.versions[1][keep][both], rails.versions[2][keep][both], place, mapped.rails.shortest, rails.natural, speed
    )
    if quality.correlation < 0.5:
        gathered.notes.append(
            f"the two wheelsets tell different rails (correlation {quality.correlation:.2f}): check the signs and axes "
            "of ay1, ay2, e1, e2"
        )
    elif abs(quality.lag) > LATE:
        gathered.notes.append(
            f"the trailing wheelset is {quality.lag:+.2f} m late beside 2a: check wheelbase, speed and clocks"
        )
    return quality, rails.natural


def _interval(columns: list[dict[str, FloatArray]]) -> float:
    t = max(columns, key=lambda c: c["t"].size)["t"]
    return float((t[-1] - t[0]) / (t.size - 1))


def _concatenated(parts: list[dict[str, FloatArray]]) -> dict[str, FloatArray]:
    names = [n for n in parts[0] if all(n in part for part in parts)]
    return {name: np.concatenate([part[name] for part in parts]) for name in names}


def _rig_run(recording: Recording, mapped: SensorMap, names: tuple[str, ...]) -> MeasuredRun:
    """The run of a test bench: what is mapped, in its own units, gaps as gaps."""
    found, counts = pieces(recording, names, SHORTEST_RIG)
    if not found:
        raise _too_short(recording, counts)
    parts = [{"t": piece.t, **quantities(mapped, recording, piece)} for piece in found]
    columns = _concatenated(parts)
    units = {"t": "s"}
    for name in set(columns) - {"t"}:
        sensor = mapped.sensors[name]
        units[name] = sensor.unit or recording.units.get(sensor.channels[0]) or "1"
    ordered = {name: columns[name] for name in RIG_COLUMNS if name in columns}
    noise = {n: x for n, x in mapped.noise.items() if n in columns}
    return MeasuredRun(ordered, units, noise, None, counts, None, {}, tuple(recording.notes))


def save_run(path: str | Path, run: MeasuredRun, comments: tuple[str, ...] = ()) -> Path:
    """Writes a run, whole or not at all."""
    return write_table(path, {f"{n} [{run.units[n]}]": x for n, x in run.columns.items()}, comments, digits=12)


def track_of(recording: Recording, mapped: SensorMap) -> dict[str, FloatArray]:
    """Columns s, yw, phiw, gauge of a recording car's places, equally spaced. FileProblems without alignment."""
    check_channels(mapped, recording)
    piece = Piece(recording.t, recording.interval, dict(recording.channels))
    q = quantities(mapped, recording, piece)
    _car_channels(q, mapped)
    if "yw" not in q:
        message, remedy = "nothing tells the lateral deviation", "map alignment_right and alignment_left, or yw"
        raise one_problem(mapped.source, message, remedy, "sensors", place=(1, 1))
    # places count down where the car runs against the mileage; its own right stays right
    forward = 1.0 if recording.t[-1] > recording.t[0] else -1.0
    columns: dict[str, FloatArray] = {"s": forward * (recording.t - recording.t[0])}
    columns |= {name: q[name] for name in ("yw", "phiw", "gauge") if name in q}
    good = np.all([np.isfinite(x) for x in columns.values()], axis=0)
    if not good.all():
        lacking = int(np.sum(~good))
        raise one_problem(recording.sources[0], f"{lacking} places have no value", "cut the track there")
    return columns
