"""Track irregularities as a CSV file, with conventions in `#` lines."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray
from railui.io.atomic import sha256_file, write_text
from railui.io.problems import Findings, file_problem, suggest_name
from railui.io.table import Table, read_header, read_table, table_text
from railui.runs.columns import COLUMNS
from railui.runs.plausibility import check_limits
from railui.runs.run import load_run
from railui.runs.units import check_magnitudes, columns_in_si
from railui.track.line import MIN_SAMPLES, SPACING_TOLERANCE

MIN_SPACING = 0.05  # m
MAX_SPACING = 1.0  # m
TRACK_COLUMNS = ("s", "yw", "phiw", "gauge")


@dataclass(frozen=True, eq=False)
class TrackColumns:
    """Columns of a track file: s [m], yw [m], phiw [rad], gauge [m], and the lines of conventions.

    `from_run`: the locations are the samples of a run's longest segment, and not equally spaced.
    """

    file: Path
    sha256: str
    s: FloatArray
    yw: FloatArray
    phiw: FloatArray
    gauge: FloatArray
    conventions: tuple[str, ...] = ()
    from_run: bool = False


def load_track(path: str | Path) -> TrackColumns:
    """Read a track, or a run as a track; raises FileProblems with every fault."""
    if Path(path).suffix.lower() in (".yaml", ".yml"):
        remedy = "give a track or a run as CSV, or a spec such as 'erri_b176_low length=2000'"
        raise file_problem(path, "is no table of a track", remedy)
    if "t" in read_header(path).names:
        return _track_of_run(path)
    table = read_table(path)
    findings = Findings(str(path))
    known = {name: COLUMNS[name] for name in TRACK_COLUMNS}
    for name in ("s", "yw"):
        if name not in table.names:
            suggestion = suggest_name(name, [n for n in table.names if n not in known])
            remedy = f"add `{name} [m]`, the {known[name].caption}"
            hint = suggestion if suggestion.startswith("did you mean") else remedy
            findings.add(name, "this column is missing", hint, position=table.header_position)
    columns, _ = columns_in_si(table, known, findings)
    findings.raise_errors()
    for name, column in columns.items():
        missing = np.flatnonzero(~np.isfinite(column))
        if missing.size:
            findings.add(
                name,
                f"{missing.size} locations have no value",
                "fill them, or cut the track there",
                position=table.cell_position(int(missing[0]), name),
            )
    _check_spacing(table, columns["s"], findings)
    check_limits(table, columns, known, findings)
    check_magnitudes(table, columns, known, findings)
    findings.raise_errors()
    zero = np.zeros_like(columns["s"])
    columns = {"phiw": zero, "gauge": zero} | columns
    s, yw, phiw, gauge = (columns[name] for name in TRACK_COLUMNS)
    return TrackColumns(Path(path), sha256_file(path), s, yw, phiw, gauge, table.comments)


def save_track(
    path: str | Path,
    s: ArrayLike,
    yw: ArrayLike,
    phiw: ArrayLike | None = None,
    gauge: ArrayLike | None = None,
    conventions: tuple[str, ...] = (),
) -> Path:
    """Write a track (m, m, rad, m) atomically; return the path."""
    return write_text(path, track_text(s, yw, phiw, gauge, conventions))


def track_text(
    s: ArrayLike,
    yw: ArrayLike,
    phiw: ArrayLike | None = None,
    gauge: ArrayLike | None = None,
    conventions: tuple[str, ...] = (),
) -> str:
    """Return the text of the file of a track (m, m, rad, m)."""
    given = {"s": s, "yw": yw, "phiw": phiw, "gauge": gauge}
    columns = {f"{name} [{COLUMNS[name].unit}]": column for name, column in given.items() if column is not None}
    return table_text(columns, conventions, digits=12)


def _track_of_run(path: str | Path) -> TrackColumns:
    run = load_run(path, "bogie", responses=False)
    longest = max(run.segments, key=lambda part: part.stop - part.start)
    s, yw, phiw, gauge = (run.columns[name][longest] for name in TRACK_COLUMNS)
    conventions = (f"measured: {run.file.name}",)
    return TrackColumns(run.file, run.sha256, s, yw, phiw, gauge, conventions, from_run=True)


def _check_spacing(table: Table, s: FloatArray, findings: Findings) -> None:
    """Report too few, unequally spaced, too dense or too coarse locations."""
    steps = np.diff(s)
    if s.size < MIN_SAMPLES:
        findings.add(
            "s",
            f"the track has {s.size} locations",
            f"give at least {MIN_SAMPLES}",
            position=table.header_position,
        )
        return
    if not np.all(np.isfinite(steps)):
        return
    spacing = float((s[-1] - s[0]) / steps.size)
    median = float(np.median(steps))
    uneven = np.flatnonzero(abs(steps - median) > SPACING_TOLERANCE * abs(median))
    if median <= 0 or uneven.size:
        row = int(uneven[0]) if uneven.size else 0
        findings.add(
            "s",
            f"{steps[row]:.6g} m from {s[row]:.6g} m to the next location, {median:.6g} m elsewhere",
            "space the locations equally",
            position=table.cell_position(row + 1, "s"),
        )
    elif not MIN_SPACING * (1 - SPACING_TOLERANCE) <= spacing <= MAX_SPACING * (1 + SPACING_TOLERANCE):
        findings.add(
            "s",
            f"the locations are {spacing:.6g} m apart",
            f"space them {MIN_SPACING:g} to {MAX_SPACING:g} m apart",
            position=table.header_position,
        )
