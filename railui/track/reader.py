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
from railui.runs.columns import COLUMNS, Column
from railui.runs.plausibility import check_limits
from railui.runs.run import load_run
from railui.runs.units import check_magnitudes, columns_in_si
from railui.track.line import MIN_SAMPLES, SPACING_TOLERANCE
from railui.track.mean_line import mean_line

MIN_SPACING = 0.05  # m
MAX_SPACING = 1.0  # m
IRREGULARITY_COLUMNS = ("s", "yw", "phiw", "gauge")
LINE_COLUMNS = {
    "curvature": Column("curvature", "1/m", "track", "curvature of the line, positive with the centre on the right"),
    "cant": Column("cant", "m", "track", "cant, positive where the left rail is higher"),
}
TRACK_COLUMNS = (*IRREGULARITY_COLUMNS, *LINE_COLUMNS)
MIN_RADIUS = 50.0  # m
MAX_CANT = 0.3  # m


@dataclass(frozen=True, eq=False)
class TrackColumns:
    """Columns of a track file: s, yw [m], phiw [rad], gauge [m], curvature [1/m], cant [m], and lines of conventions.

    `from_run`: the locations are the samples of a run's longest segment, and not equally spaced. `seed`: of the
    spectrum of a designed line, whose irregularities have no mean line.
    """

    file: Path
    sha256: str
    s: FloatArray
    yw: FloatArray
    phiw: FloatArray
    gauge: FloatArray
    curvature: FloatArray
    cant: FloatArray
    conventions: tuple[str, ...] = ()
    from_run: bool = False
    seed: int | None = None


def load_track(path: str | Path) -> TrackColumns:
    """Read a track, or a run as a track; raises FileProblems with every fault."""
    if Path(path).suffix.lower() in (".yaml", ".yml"):
        remedy = "give a track or a run as CSV, a designed line as YAML, or a spec such as 'erri_b176_low length=2000'"
        raise file_problem(path, "is no table of a track", remedy)
    if "t" in read_header(path).names:
        return _track_of_run(path)
    table = read_table(path)
    findings = Findings(str(path))
    known = {name: COLUMNS[name] for name in IRREGULARITY_COLUMNS} | LINE_COLUMNS
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
    irregularities = {name: column for name, column in columns.items() if name not in LINE_COLUMNS}
    irregularities["yw"] = _from_mean_line(columns["s"], columns["yw"])
    check_limits(table, irregularities, known, findings)
    _check_line(table, columns, findings)
    check_magnitudes(table, irregularities, known, findings)
    findings.raise_errors()
    columns = dict.fromkeys(TRACK_COLUMNS, np.zeros_like(columns["s"])) | columns
    s, yw, phiw, gauge, curvature, cant = (columns[name] for name in TRACK_COLUMNS)
    return TrackColumns(Path(path), sha256_file(path), s, yw, phiw, gauge, curvature, cant, table.comments)


def _from_mean_line(s: FloatArray, yw: FloatArray) -> FloatArray:
    """Return yw from its mean line, as a ride takes it; unchanged where the table has faults."""
    if s.size < MIN_SAMPLES or not np.isfinite([s, yw]).all() or np.any(np.diff(s) <= 0):
        return yw
    offset, heading = mean_line(s, yw)
    return np.asarray(yw - offset - heading * (s - s[0]))


def _check_line(table: Table, columns: dict[str, FloatArray], findings: Findings) -> None:
    """Report curvature and cant beyond any line."""
    limits = {
        "curvature": (1.0 / MIN_RADIUS, "write `curvature [1/m]`: the radius of a line is above 50 m"),
        "cant": (MAX_CANT, "write the right unit in the header, such as `cant [mm]`"),
    }
    for name, (limit, remedy) in limits.items():
        beyond = np.flatnonzero(np.abs(columns[name]) > limit) if name in columns else np.zeros(0, dtype=np.int64)
        if beyond.size:
            row, unit = int(beyond[0]), LINE_COLUMNS[name].unit
            message = f"is {columns[name][row]:.6g} {unit}, more than the {limit:g} {unit} that are possible"
            findings.add(name, message, remedy, position=table.cell_position(row, name))


def save_track(
    path: str | Path,
    s: ArrayLike,
    yw: ArrayLike,
    phiw: ArrayLike | None = None,
    gauge: ArrayLike | None = None,
    conventions: tuple[str, ...] = (),
    curvature: ArrayLike | None = None,
    cant: ArrayLike | None = None,
) -> Path:
    """Write a track (m, m, rad, m, 1/m, m) atomically; return the path."""
    return write_text(path, track_text(s, yw, phiw, gauge, conventions, curvature, cant))


def track_text(
    s: ArrayLike,
    yw: ArrayLike,
    phiw: ArrayLike | None = None,
    gauge: ArrayLike | None = None,
    conventions: tuple[str, ...] = (),
    curvature: ArrayLike | None = None,
    cant: ArrayLike | None = None,
) -> str:
    """Return the text of the file of a track (m, m, rad, m, 1/m, m)."""
    given = {"s": s, "yw": yw, "phiw": phiw, "gauge": gauge, "curvature": curvature, "cant": cant}
    known = COLUMNS | LINE_COLUMNS
    columns = {f"{name} [{known[name].unit}]": column for name, column in given.items() if column is not None}
    return table_text(columns, conventions, digits=12)


def _track_of_run(path: str | Path) -> TrackColumns:
    run = load_run(path, "bogie", responses=False)
    longest = max(run.segments, key=lambda part: part.stop - part.start)
    s, yw, phiw, gauge = (run.columns[name][longest] for name in IRREGULARITY_COLUMNS)
    straight = np.zeros_like(s)
    conventions = (f"measured: {run.file.name}",)
    return TrackColumns(run.file, run.sha256, s, yw, phiw, gauge, straight, straight, conventions, from_run=True)


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
