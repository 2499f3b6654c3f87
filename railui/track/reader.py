"""Track irregularities as a CSV file, with conventions in `#` lines."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray
from railui.io.atomic import sha256_file, write_text
from railui.io.problems import Findings, Problem, file_problem, suggest_name
from railui.io.table import Table, read_header, read_table, table_text
from railui.runs.columns import COLUMNS, Column
from railui.runs.plausibility import check_limits
from railui.runs.run import Run, load_run
from railui.runs.units import check_magnitudes, columns_in_si
from railui.track.line import MIN_SAMPLES, SPACING_TOLERANCE
from railui.track.line_checks import sign_warnings, twist_warnings
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
    spectrum of a designed line, whose irregularities have no mean line. `warnings`: implausible places of the line and
    columns that are not used.
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
    warnings: tuple[Problem, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings in words, for a result on this track."""
        return tuple(f"{each.key}: {each.message}, {each.remedy}" for each in self.warnings)


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
    _check_names(table, known, findings)
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
    _check_line(columns, findings, table)
    check_magnitudes(table, irregularities, known, findings)
    findings.raise_errors()
    columns = dict.fromkeys(TRACK_COLUMNS, np.zeros_like(columns["s"])) | columns
    s, yw, phiw, gauge, curvature, cant = (columns[name] for name in TRACK_COLUMNS)
    _warn_of_line(table, s, curvature, cant, findings)
    values = (s, yw, phiw, gauge, curvature, cant)
    return TrackColumns(Path(path), sha256_file(path), *values, table.comments, warnings=findings.warnings())


def _check_names(table: Table, known: dict[str, Column], findings: Findings) -> None:
    """Report a radius in place of the curvature; warn of columns that are not used."""
    for name, column in zip(table.names, table.column_positions, strict=True):
        position = (table.header_position[0], column)
        if name == "radius" and "curvature" not in table.names:
            remedy = (
                "write `curvature [1/m]`, its reciprocal, 0 on straight track, positive with the centre on the right"
            )
            findings.add(name, "a track has no column radius", remedy, position=position)
        elif name not in known:
            findings.warn(name, "this column is not used", suggest_name(name, known), position=position)


def _warn_of_line(table: Table, s: FloatArray, curvature: FloatArray, cant: FloatArray, findings: Findings) -> None:
    """Warn of implausible places of a line with curves."""
    for each in (*twist_warnings(s, cant), *sign_warnings(curvature, cant)):
        findings.warn(each.column, each.message, each.remedy, position=table.cell_position(each.sample, each.column))


def _from_mean_line(s: FloatArray, yw: FloatArray) -> FloatArray:
    """Return yw from its mean line, as a ride takes it; unchanged where the table has faults."""
    if s.size < MIN_SAMPLES or not np.isfinite([s, yw]).all() or np.any(np.diff(s) <= 0):
        return yw
    with np.errstate(over="ignore", invalid="ignore"):  # numbers beyond their limit are reported as they are
        offset, heading = mean_line(s, yw)
        result = np.asarray(yw - offset - heading * (s - s[0]))
    return result if np.isfinite(result).all() else yw


def _check_line(columns: dict[str, FloatArray], findings: Findings, table: Table | None = None) -> None:
    """Report curvature and cant beyond any line, with their position in a table."""
    limits = {
        "curvature": (1.0 / MIN_RADIUS, "write `curvature [1/m]`: the radius of a line is above 50 m"),
        "cant": (MAX_CANT, "write the right unit in the header, such as `cant [mm]`"),
    }
    for name, (limit, remedy) in limits.items():
        beyond = np.flatnonzero(np.abs(columns[name]) > limit) if name in columns else np.zeros(0, dtype=np.int64)
        if beyond.size:
            row, unit = int(beyond[0]), LINE_COLUMNS[name].unit
            message = f"is {columns[name][row]:.6g} {unit}, more than the {limit:g} {unit} that are possible"
            findings.add(name, message, remedy, position=None if table is None else table.cell_position(row, name))


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
    conventions = (f"measured: {run.file.name}",)
    values = (s, yw, phiw, gauge, *_line_of_run(run, longest))
    return TrackColumns(run.file, run.sha256, *values, conventions, from_run=True)


def _line_of_run(run: Run, rows: slice) -> tuple[FloatArray, FloatArray]:
    """Return curvature [1/m] and cant [m] in the rows of a run, 0 where it has none."""
    straight = np.zeros(rows.stop - rows.start)
    if not set(LINE_COLUMNS) & set(run.unknown_columns):
        return straight, straight
    table, findings = read_table(run.file), Findings(str(run.file))
    columns, _ = columns_in_si(table, LINE_COLUMNS, findings)
    findings.raise_errors()
    timed = np.flatnonzero(np.isfinite(table.column("t")))  # the rows of a run
    columns = {name: column[timed][rows] for name, column in columns.items()}
    for name, column in columns.items():
        missing = int(np.count_nonzero(~np.isfinite(column)))
        if missing:
            message = f"{missing} rows of the longest segment have no value"
            findings.add(name, message, "fill them, or cut the run there")
    _check_line(columns, findings)
    findings.raise_errors()
    return columns.get("curvature", straight), columns.get("cant", straight)


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
