"""A track as a CSV file: what the leading wheelset meets, with its conventions in `#` lines."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray
from railui.io.atomic import sha256_file, write_text
from railui.io.problems import Findings, suggest_name, file_problem
from railui.io.table import Table, read_header, read_table, table_text
from railui.runs.columns import COLUMNS
from railui.runs.run import load_run
from railui.runs.units import check_magnitudes, columns_in_si

MIN_SPACING, MAX_SPACING = 0.05, 1.0  # m
UNEVEN = 0.01
NAMES = ("s", "yw", "phiw", "gauge")


@dataclass(frozen=True, eq=False)
class TrackColumns:
    """s [m], yw [m], phiw [rad], gauge [m], one value each per place, and the lines of conventions.

    `from_run`: the places are a run's samples, its longest stretch, and not equally spaced.
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
    """Reads a track, or a run as a track; FileProblems with every fault."""
    if Path(path).suffix.lower() in (".yaml", ".yml"):
        remedy = "give a track or a run as CSV, or a spec such as 'erri_b176_low length=2000'"
        raise file_problem(path, "is no table of a track", remedy)
    if "t" in read_header(path).names:
        return _of_run(path)
    table = read_table(path)
    findings = Findings(str(path))
    known = {name: COLUMNS[name] for name in NAMES}
    for name in ("s", "yw"):
        if name not in table.names:
            told = suggest_name(name, [n for n in table.names if n not in known])
            hint = told if told.startswith("did you mean") else f"add `{name} [m]`, the {known[name].caption}"
            findings.add(name, "this column is missing", hint, position=table.header_position)
    columns, _ = columns_in_si(table, known, findings)
    findings.raise_errors()
    for name, column in columns.items():
        lacking = np.flatnonzero(~np.isfinite(column))
        if lacking.size:
            findings.add(
                name,
                f"{lacking.size} places have no value",
                "fill them, or cut the track there",
                position=table.cell_position(int(lacking[0]), name),
            )
    _spacing(table, columns["s"], findings)
    check_magnitudes(table, columns, known, findings)
    findings.raise_errors()
    zero = np.zeros_like(columns["s"])
    columns = {"phiw": zero, "gauge": zero} | columns
    s, yw, phiw, gauge = (columns[name] for name in NAMES)
    return TrackColumns(Path(path), sha256_file(path), s, yw, phiw, gauge, table.comments)


def save_track(
    path: str | Path,
    s: ArrayLike,
    yw: ArrayLike,
    phiw: ArrayLike | None = None,
    gauge: ArrayLike | None = None,
    conventions: tuple[str, ...] = (),
) -> Path:
    """Writes a track (m, m, rad, m) whole or not at all; returns the path."""
    return write_text(path, track_text(s, yw, phiw, gauge, conventions))


def track_text(
    s: ArrayLike,
    yw: ArrayLike,
    phiw: ArrayLike | None = None,
    gauge: ArrayLike | None = None,
    conventions: tuple[str, ...] = (),
) -> str:
    """A track (m, m, rad, m) as the text of its file."""
    given = {"s": s, "yw": yw, "phiw": phiw, "gauge": gauge}
    columns = {f"{name} [{COLUMNS[name].unit}]": column for name, column in given.items() if column is not None}
    return table_text(columns, conventions, digits=12)


def _of_run(path: str | Path) -> TrackColumns:
    run = load_run(path, "bogie", responses=False)
    longest = max(run.segments, key=lambda part: part.stop - part.start)
    s, yw, phiw, gauge = (run.columns[name][longest] for name in NAMES)
    told = (f"measured: {run.file.name}",)
    return TrackColumns(run.file, run.sha256, s, yw, phiw, gauge, told, from_run=True)


def _spacing(table: Table, s: FloatArray, findings: Findings) -> None:
    steps = np.diff(s)
    if steps.size < 3 or not np.all(np.isfinite(steps)):
        if steps.size < 3:
            findings.add("s", f"the track has {s.size} places", "give 4 at least", position=table.header_position)
        return
    spacing = float((s[-1] - s[0]) / steps.size)
    middle = float(np.median(steps))
    uneven = np.flatnonzero(abs(steps - middle) > UNEVEN * abs(middle))
    if middle <= 0 or uneven.size:
        row = int(uneven[0]) if uneven.size else 0
        findings.add(
            "s",
            f"{steps[row]:.6g} m from {s[row]:.6g} m to the next place, {middle:.6g} m elsewhere",
            "space the places equally",
            position=table.cell_position(row + 1, "s"),
        )
    elif not MIN_SPACING * (1 - UNEVEN) <= spacing <= MAX_SPACING * (1 + UNEVEN):
        findings.add(
            "s",
            f"the places are {spacing:.6g} m apart",
            f"space them {MIN_SPACING:g} to {MAX_SPACING:g} m apart",
            position=table.header_position,
        )
