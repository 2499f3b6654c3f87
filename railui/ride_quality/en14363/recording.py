"""Recording of a run for EN 14363: forces, accelerations, curvature and cant deficiency along the track."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.io.problems import Findings, file_problem
from railui.io.table import Table, read_table
from railui.ride_quality.en14363.plausibility import check_forces, check_speed, note_unused
from railui.ride_quality.guiding_forces import guiding_force_channels, wheel_load_paths
from railui.runs.columns import COLUMNS, Column
from railui.runs.segments import sampling_rate
from railui.runs.units import columns_in_si
from railui.track.excitation import Excitation
from railui.track.line_geometry import cant_deficiency, cant_deficiency_of
from railui.vehicle.model import Model
from railui.vehicle.on_track import half_gauges
from railui.vehicle.simulate import simulate_series

FORCE_COLUMN: Final = re.compile(r"[YQ]\d+\.(right|left)|Y\d+")
BODY_COLUMN: Final = re.compile(r"(ay_body|floor)(\.\w+)?")
FRAME_COLUMN: Final = re.compile(r"ayf(\.\w+)?")
CLOCK: Final = {
    "t": Column("t", "s", "clock", "time"),
    "s": Column("s", "m", "clock", "distance"),
    "v": Column("v", "m/s", "clock", "speed"),
    "curvature": Column("curvature", "1/m", "track", "curvature of the track, right-hand curves positive"),
    "radius": Column("radius", "m", "track", "radius of the track, right-hand curves positive, 0 on tangent track"),
    "cant_deficiency": Column("cant_deficiency", "m", "track", "cant deficiency"),
    "cant": Column("cant", "m", "track", "cant, positive where the left rail is higher"),
}
MAX_VALUES: Final = {"N": 1e7, "m/s^2": 1e4}  # beyond any vehicle: a wrong unit
STANDARD_HALF_GAUGE: Final = 0.75  # m, half the distance of the rolling circles of standard gauge
MIN_SPEED: Final = 1.0  # m/s, below which a vehicle stands
GAP_INTERVALS: Final = 1.5  # sampling intervals
MIN_DURATION: Final = 5.0  # s of an unbroken piece


@dataclass(frozen=True, eq=False)
class Recording:
    """Unbroken piece of a run.

    Attributes
    ----------
    s, v, curvature, cant_deficiency : FloatArray
        Distance [m], speed [m/s], curvature [1/m], cant deficiency [m], [sample].
    rate : float
        Sampling rate [Hz].
    series : mapping
        Arrays [sample] by name: Yi.right, Yi.left (to the right, N), Yi their sum, Qi.right, Qi.left (N),
        ay_body.POINT or floor.POINT, ayf (m/s^2).
    """

    s: FloatArray
    v: FloatArray
    curvature: FloatArray
    cant_deficiency: FloatArray
    rate: float
    series: Mapping[str, FloatArray]

    @property
    def wheelsets(self) -> list[int]:
        """Numbers of the wheelsets with a measured force."""
        return sorted({int(m[1]) for name in self.series if (m := re.match(r"Y(\d+)", name))})

    def total(self, wheelset: int) -> FloatArray | None:
        """Return the sum of guiding forces [sample] of a wheelset; None if it was not measured."""
        right, left = (self.series.get(f"Y{wheelset}.{side}") for side in ("right", "left"))
        return self.series.get(f"Y{wheelset}") if right is None or left is None else right + left

    def names(self, pattern: re.Pattern[str]) -> list[str]:
        """Return the names of the series that match a pattern."""
        return [name for name in self.series if pattern.fullmatch(name)]


def simulate_recording(
    model: Model, excitation: Excitation, jobs: int | None = 1
) -> tuple[list[Recording], float | None]:
    """Simulate a vehicle on a track; return its recording and the distance [m] at which it diverged, or None.

    Curvature and cant deficiency are those of the line under the leading wheelset.

    The recording ends there; it is empty within 5 s.
    """
    available = model.vehicles().channel_names(model.single_batch())
    others = [name for name in available if name.startswith("floor.") or name == "ayf"]
    forces = guiding_force_channels(model)
    series, diverged_at = simulate_series(model, excitation, [*forces, *others], jobs=jobs)
    n = len(excitation.track) if diverged_at is None else diverged_at
    values = dict(zip([*forces, *others], series[:, :n], strict=True))
    for i, path in enumerate(wheel_load_paths(model), 1):
        transfer = values.pop(f"dQ{i}", None)
        load = model.design.values[path]
        values[f"Q{i}.right"] = np.full(n, load) if transfer is None else load + transfer
        values[f"Q{i}.left"] = np.full(n, load) if transfer is None else load - transfer
    track = excitation.track
    half_gauge = float(half_gauges(model, model.row[None])[0])
    deficiency = cant_deficiency(track, excitation.speed, half_gauge)[:n]
    speed = np.full(n, excitation.speed)
    end = None if diverged_at is None else excitation.distance_at(diverged_at)
    if n * excitation.dt < MIN_DURATION * (1.0 - 1e-6):
        return [], end
    return [Recording(track.s[:n], speed, track.curvature[:n], deficiency, 1.0 / excitation.dt, values)], end


def _check_values(
    table: Table,
    columns: Mapping[str, FloatArray],
    known: Mapping[str, Column],
    wheelsets: int | None,
    findings: Findings,
) -> None:
    """Report values beyond any vehicle, and forces of wheelsets that the design does not have."""
    for name, column in columns.items():
        limit = MAX_VALUES.get(known[name].unit)
        values = np.abs(column[np.isfinite(column)])
        if name not in CLOCK and limit is not None and values.size and values.max() > limit:
            message = f"reaches {values.max():.3g} {known[name].unit}, more than any vehicle"
            findings.add(name, message, "give the right unit in the header", position=table.header_position)
        number = re.match(r"[YQ](\d+)", name)
        if number and wheelsets is not None and not 1 <= int(number[1]) <= wheelsets:
            message = f"the design has {wheelsets} wheelsets"
            findings.add(name, message, "number them from the front, from 1", position=table.header_position)


def is_recording(names: Sequence[str]) -> bool:
    """Return True for the columns of a run for EN 14363 alone: forces or accelerations of the body, and no track.

    >>> is_recording(["t", "v", "Y1.right"]), is_recording(["t", "v", "yw", "e1", "ayf"])
    (True, False)
    """
    if "yw" in names:
        return False
    is_of_method = any(pattern.fullmatch(name) for name in names for pattern in (FORCE_COLUMN, BODY_COLUMN))
    others = set(COLUMNS) - set(CLOCK) - {"ayf"}
    return is_of_method or (any(FRAME_COLUMN.fullmatch(name) for name in names) and others.isdisjoint(names))


def read_recording(
    path: str | Path, wheel_loads: Sequence[float] | None = None, half_gauge: float = STANDARD_HALF_GAUGE
) -> tuple[list[Recording], list[str]]:
    """Read the measured columns of a run of a vehicle with wheel loads [wheelset] N; return its pieces and notes.

    Without wheel loads the forces are not compared with those of a vehicle. half_gauge: b [m], for the cant deficiency
    of a run that has curvature and cant.

    Raises
    ------
    FileProblems
        For a faulty table, absent t or v, no column that the method evaluates, or values beyond the vehicle.
    """
    table = read_table(path)
    findings = Findings(str(path))
    units = {FORCE_COLUMN: "N", BODY_COLUMN: "m/s^2", FRAME_COLUMN: "m/s^2"}
    known = dict(CLOCK)
    for name in table.names:
        unit = next((u for pattern, u in units.items() if pattern.fullmatch(name)), None)
        if unit is not None:
            known[name] = Column(name, unit, "response", name)
    columns, _ = columns_in_si(table, known, findings)
    for name in ("t", "v"):
        if name not in table.names:
            findings.add(name, "this column is missing", f"add `{name} [{CLOCK[name].unit}]`")
    _check_values(table, columns, known, None if wheel_loads is None else len(wheel_loads), findings)
    check_speed(table, columns, findings)
    notes = note_unused(table, known)
    notes += [] if wheel_loads is None else check_forces(table, columns, wheel_loads, findings)
    findings.raise_errors()
    measured = [name for name in columns if name not in CLOCK]
    if not measured:
        remedy = "give guiding forces Y1.right [N], Y1.left [N], a carbody acceleration ay_body [m/s^2] or ayf [m/s^2]"
        raise file_problem(path, "has no column that EN 14363 evaluates", remedy)
    rows = np.flatnonzero(np.isfinite(columns["t"]))
    columns = {name: column[rows] for name, column in columns.items()}
    rate = sampling_rate(table, columns["t"], rows, findings)
    findings.raise_errors()
    notes += _complete(columns, half_gauge)
    pieces = [part for part in _pieces(columns, measured, rate) if part.stop - part.start >= MIN_DURATION * rate]
    if not pieces:
        raise file_problem(path, f"has no unbroken piece of {MIN_DURATION:g} s", "record longer, or fill the gaps")
    if len(pieces) > 1:
        notes.append(f"{len(pieces)} unbroken pieces; no section crosses a gap")
    return [_piece(columns, part, rate, measured) for part in pieces], notes


def _piece(columns: Mapping[str, FloatArray], rows: slice, rate: float, measured: list[str]) -> Recording:
    return Recording(
        s=columns["s"][rows],
        v=columns["v"][rows],
        curvature=columns["curvature"][rows],
        cant_deficiency=columns["cant_deficiency"][rows],
        rate=rate,
        series={name: columns[name][rows] for name in measured},
    )


def _complete(columns: dict[str, FloatArray], half_gauge: float) -> list[str]:
    """Add s, curvature and cant deficiency where they are absent; return notes on them."""
    notes = []
    t, v = columns["t"], columns["v"]
    if "s" not in columns:
        steps = 0.5 * (np.nan_to_num(v[1:]) + np.nan_to_num(v[:-1])) * np.diff(t)
        columns["s"] = np.concatenate([[0.0], np.cumsum(steps)])
        notes.append("s is absent: the integral of v")
    if "curvature" not in columns:
        radius = columns.pop("radius", None)
        if radius is None:
            columns["curvature"] = np.zeros_like(t)
            notes.append("curvature and radius are absent: all sections count as tangent track")
        else:
            columns["curvature"] = np.where(radius == 0.0, 0.0, 1.0 / np.where(radius == 0.0, 1.0, radius))
    if "cant_deficiency" not in columns and "cant" in columns:
        columns["cant_deficiency"] = cant_deficiency_of(columns["curvature"], columns["cant"], v, half_gauge)
        notes.append("cant_deficiency is absent: from v, curvature and cant")
    if "cant_deficiency" not in columns:
        columns["cant_deficiency"] = np.zeros_like(t)
        notes.append("cant_deficiency is absent: taken as 0, curves above 600 m count as tangent track")
    return notes


def _pieces(columns: Mapping[str, FloatArray], measured: list[str], rate: float) -> list[slice]:
    """Return the ranges of rows without gap, missing value or standstill."""
    used = [columns[name] for name in ("s", "v", "curvature", "cant_deficiency", *measured)]
    good: NDArray[np.bool_] = np.all(np.isfinite(used), axis=0) & (np.nan_to_num(columns["v"]) >= MIN_SPEED)
    is_cut = np.concatenate([[True], np.diff(columns["t"]) * rate > GAP_INTERVALS]) | ~good
    is_cut |= np.concatenate([[False], ~good[:-1]])
    starts = np.flatnonzero(is_cut & good)
    ends = [int(np.flatnonzero(np.append(is_cut[a + 1 :], True))[0]) + a + 1 for a in starts]
    return [slice(int(a), b) for a, b in zip(starts, ends, strict=True)]
