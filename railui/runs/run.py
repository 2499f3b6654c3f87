"""Measured run: columns in SI, usable segments, and counts of unusable rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.io.atomic import sha256_file
from railui.io.problems import Findings, Problem, suggest_name
from railui.io.table import Table, read_header, read_table
from railui.io.units import MAX_PLAUSIBLE_SPEED
from railui.runs.columns import FORMS, RIG_FORMS, Column, Form, column_names, columns_of
from railui.runs.plausibility import check_limits, warn_of_implausible
from railui.runs.segments import Segments, find_segments, sampling_rate, warn_of_interruptions
from railui.runs.units import bench_columns, check_magnitudes, columns_in_si, rig_columns

MAX_RIG_RATE, MAX_RIG_ROWS = 1e5, 1_000_000
MIN_VEHICLE_RATE = 10.0  # Hz, below which nothing is left of the lateral motions of a bogie

FREE_HINT = {"yw": " (zeros where nothing excites the vehicle)"}


@dataclass(frozen=True, eq=False)
class Run:
    """Measured run.

    Attributes
    ----------
    file : Path
    sha256 : str
    kind : str or VehicleColumns
        "bogie", "rig" or "bench"; of any other vehicle the columns that its runs may have.
    columns : mapping
        Arrays [row] by name in SI (rig: in the units of the run; bench: in SI where the unit is known), NaN for missing
        values.
    units : mapping
        Unit of each column in the file.
    rate : float
        Sampling rate [Hz].
    segments : tuple of slice
        Rows without gaps or missing values.
    counts : mapping
        rows, used, stretches, gaps, missing_rows, nan_rows, stuck, stuck_rows, standing_rows, short_stretches,
        unused_rows.
    responses, coach_forces : tuple of str
        Measured motions, and measured forces of the coach.
    unknown_columns : tuple of str
        Columns that the model does not use; `unknown_values` contains their numbers.
    notes : tuple of str
        Remarks for the report.
    warnings : tuple of Problem
        Implausible values, with position and remedy.
    """

    file: Path
    sha256: str
    kind: Form
    columns: Mapping[str, FloatArray]
    units: Mapping[str, str]
    rate: float
    segments: tuple[slice, ...]
    counts: Mapping[str, int]
    responses: tuple[str, ...]
    coach_forces: tuple[str, ...]
    unknown_columns: tuple[str, ...]
    notes: tuple[str, ...]
    unknown_values: Mapping[str, FloatArray]
    warnings: tuple[Problem, ...] = ()

    def __len__(self) -> int:
        return int(self.columns["t"].size)


def load_run(
    path: str | Path, kind: Form | None = None, *, responses: bool = True, units: Mapping[str, str] | None = None
) -> Run:
    """Read a run.

    Parameters
    ----------
    path : path
    kind : str or VehicleColumns, optional
        "bogie", "rig", "bench" or the columns of any other vehicle; detected from the columns by default.
    responses : bool
        False for a run that needs no measured response, since only its track is used.
    units : mapping, optional
        Units of columns that replace those of the header.

    Raises
    ------
    FileProblems
        With every problem of the file.
    """
    _refuse_foreign_header(path, kind)
    table = read_table(path)
    if units:
        labels = (units.get(name, label) for name, label in zip(table.names, table.units, strict=True))
        table = replace(table, units=tuple(labels))
    return run_of_table(table, sha256_file(path), kind, responses=responses)


def _refuse_foreign_header(path: str | Path, kind: Form | None) -> None:
    """Raise FileProblems for a file none of whose columns has the name of a run's: it comes from another program."""
    header = read_header(path)
    known = set(columns_of(kind)) if kind is not None else {name for form in FORMS.values() for name in form}
    if known & set(header.names):
        return
    findings = Findings(str(path))
    findings.add(
        "",
        f"has none of the columns of a run ({', '.join(list(columns_of(kind or 'bogie'))[:4])}, ...)",
        f"`railui import {path} --draft map.yaml` begins a map that makes a run of it",
        position=(header.line, 1),
    )
    findings.raise_errors()


def run_of_table(table: Table, sha256: str, kind: Form | None = None, *, responses: bool = True) -> Run:
    """Return the run of a table; parameters and exceptions as `load_run`.

    sha256: hash of the file, or of what the table was made of.
    """
    findings = Findings(table.file)
    form = kind or detect_kind(table.names)
    known = columns_of(form)
    notes: list[str] = []
    columns, units = _read_columns(table, known, form, findings, notes)
    _check_required(table, columns, form, findings, responses)
    findings.raise_errors()
    _drop_constant_channels(columns, form, notes, findings, table, responses)
    if form not in RIG_FORMS:
        check_limits(table, columns, known, findings)
    check_magnitudes(table, columns, known, findings)
    findings.raise_errors()
    rows = np.flatnonzero(np.isfinite(columns["t"]))
    columns = columns if rows.size == len(table.rows) else {name: column[rows] for name, column in columns.items()}
    rate = sampling_rate(table, columns["t"], rows, findings)
    findings.raise_errors()
    if form in RIG_FORMS:
        _check_rig_limits(rate, len(rows), findings)
    elif responses:
        _check_vehicle_rate(rate, table, findings)
    distance = _add_absent_columns(columns, form, notes)
    if distance is not None:
        warn_of_implausible(table, columns, rows, distance, known, findings)
    segments = find_segments(columns, rate, form)
    _require_segment(segments, rate, findings)
    _check_distance(table, columns, segments, rows, form, findings)
    warn_of_interruptions(table, columns, rows, rate, form, findings)
    findings.raise_errors()
    unknown = tuple(name for name in table.names if name not in known)
    return Run(
        file=Path(table.file),
        sha256=sha256,
        kind=form,
        columns=columns,
        units=units,
        rate=rate,
        segments=segments.slices,
        counts=segments.counts | {"nan_rows": segments.counts["nan_rows"] + len(table.rows) - rows.size},
        responses=tuple(n for n in column_names(form, "response") if n in columns),
        coach_forces=tuple(n for n in column_names(form, "coach") if n in columns),
        unknown_columns=unknown,
        notes=tuple(notes),
        unknown_values={name: table.column(name)[rows] for name in unknown},
        warnings=findings.warnings(),
    )


def detect_kind(names: tuple[str, ...]) -> str:
    """Return the kind of a run: a rig has z, vz or az and neither speed nor track, a bench a force F besides z.

    >>> detect_kind(("t", "u", "z")), detect_kind(("t", "v", "yw", "e1")), detect_kind(("t", "z", "F"))
    ('rig', 'bogie', 'bench')
    """
    if {"v", "yw"} & set(names):
        return "bogie"
    if {"z", "F"} <= set(names) and "u" not in names:
        return "bench"
    return "rig" if set(column_names("rig", "response")) & set(names) else "bogie"


def _read_columns(
    table: Table, known: Mapping[str, Column], form: Form, findings: Findings, notes: list[str]
) -> tuple[dict[str, FloatArray], dict[str, str]]:
    if form == "bench":
        return bench_columns(table, known, findings, notes)
    if form == "rig":
        return rig_columns(table, known, findings, notes)
    return columns_in_si(table, known, findings)


def _check_required(
    table: Table, columns: Mapping[str, FloatArray], form: Form, findings: Findings, responses: bool
) -> None:
    required = {"rig": ("t",), "bench": ("t", "z")}.get(str(form), ("t", "v", "yw"))
    for name in required:
        if name not in table.names:
            column = columns_of(form)[name]
            suggestion = suggest_name(name, [n for n in table.names if n not in columns_of(form)])
            hint = (
                suggestion
                if suggestion.startswith("did you mean")
                else f"add `{name} [{column.unit or 'm'}]`, the {column.caption}{FREE_HINT.get(name, '')}"
            )
            findings.add(name, "this column is missing", hint, position=table.header_position)
    measured = column_names(form, "response")
    if responses and not set(measured) & set(table.names):
        findings.add(
            "", "no response is measured", f"add at least one of {', '.join(measured)}", position=table.header_position
        )


def _drop_constant_channels(
    columns: dict[str, FloatArray], form: Form, notes: list[str], findings: Findings, table: Table, responses: bool
) -> None:
    """Remove channels without a value or with a constant one: they were not connected."""
    for name in (*column_names(form, "track", "response", "coach"), "s"):
        column = columns.get(name)
        if column is None:
            continue
        values = column[np.isfinite(column)]
        constant = values.size == 0 or (
            np.ptp(values) == 0 and (name in column_names(form, "response") or values[0] != 0)
        )
        if constant and not (form == "rig" and name == "u" and values.size):
            state = "has no value" if values.size == 0 else f"is {values[0]:g} throughout"
            if name == "yw" or (form == "bench" and name == "z"):
                needed = "the track" if name == "yw" else "the motion"
                findings.add(
                    name,
                    state,
                    f"{needed} is needed: record it, or give the right column",
                    position=table.header_position,
                )
            else:
                notes.append(f"{name} {state}: not used")
                remedy = "it is not used; connect the sensor, or leave the column out"
                findings.warn(name, state, remedy, position=table.header_position)
                del columns[name]
    if form not in RIG_FORMS and not np.any(np.isfinite(columns["v"])):
        findings.add("v", "has no value", "give the speed", position=table.header_position)
    if responses and not set(column_names(form, "response")) & set(columns):
        findings.add("", "no response varies", "give at least one that varies", position=table.header_position)


def _add_absent_columns(columns: dict[str, FloatArray], form: Form, notes: list[str]) -> FloatArray | None:
    """Add absent columns: s from v, track columns and the input as zero; return the integral of v, None for a rig."""
    if form == "bench":
        return None
    for name in column_names(form, "track"):
        if name not in columns:
            columns[name] = np.zeros_like(columns["t"])
            notes.append(f"{name} is absent: taken as 0")
    if form == "rig":
        return None
    t, v = columns["t"], columns["v"]
    alive = np.isfinite(v)
    whole = v if alive.all() else np.interp(t, t[alive], v[alive])
    distance = np.concatenate(([0.0], np.cumsum(0.5 * (whole[1:] + whole[:-1]) * np.diff(t))))
    if "s" not in columns:
        columns["s"] = distance
        notes.append("s is absent: the integral of v")
    else:
        _compare_distances(columns["s"], distance, notes)
    if np.median(whole) > MAX_PLAUSIBLE_SPEED:
        notes.append(f"v is {np.median(whole):.4g} m/s in the median: is it in km/h?")
    return distance


def _compare_distances(s: FloatArray, integral: FloatArray, notes: list[str]) -> None:
    ends = np.flatnonzero(np.isfinite(s))[[0, -1]]
    measured = float(np.diff(s[ends])[0])
    driven = float(np.diff(integral[ends])[0])
    if driven > 0 and abs(measured / driven - 1) > 0.02:
        notes.append(f"s covers {measured:.6g} m, the integral of v {driven:.6g} m: check both")


def _check_rig_limits(rate: float, rows: int, findings: Findings) -> None:
    if rate > MAX_RIG_RATE * 1.001:
        findings.add("t", f"{rate:.6g} Hz is more than {MAX_RIG_RATE:g} Hz", "resample the run")
    if rows > MAX_RIG_ROWS:
        findings.add("t", f"{rows} rows are more than {MAX_RIG_ROWS}", "cut the run into parts")


def _check_vehicle_rate(rate: float, table: Table, findings: Findings) -> None:
    """Raise FileProblems for a rate [Hz] at which the motions of a vehicle are lost."""
    if rate < MIN_VEHICLE_RATE:
        message = f"rises by {1.0 / rate:.4g} s per row: {rate:.3g} Hz is too slow for the motions of a vehicle"
        remedy = "t is in s: write its unit where it is another, as in `t [ms]`, or record with at least "
        findings.add("t", message, f"{remedy}{MIN_VEHICLE_RATE:g} Hz", position=table.header_position)
        findings.raise_errors()


def _require_segment(segments: Segments, rate: float, findings: Findings) -> None:
    if segments.slices:
        return
    counts = segments.counts
    interruptions = (
        f"{counts['rows']} rows, {counts['gaps']} gaps, {counts['nan_rows']} rows with empty cells, "
        f"{counts['stuck']} times a stuck channel, {counts['standing_rows']} rows at standstill"
    )
    duration = segments.min_samples / rate
    remedy = "record longer, or leave out the channel that interrupts it"
    if counts["rows"] < segments.min_samples:
        remedy = f"record longer; {counts['rows']} rows at {rate:.4g} Hz last {counts['rows'] / rate:.3g} s: t is in s"
    findings.add("", f"no segment of {duration:.4g} s is without interruption ({interruptions})", remedy)


def _check_distance(
    table: Table,
    columns: Mapping[str, FloatArray],
    segments: Segments,
    rows: np.ndarray,
    form: Form,
    findings: Findings,
) -> None:
    if form in RIG_FORMS:
        return
    for segment in segments.slices:
        back = np.flatnonzero(np.diff(columns["s"][segment]) <= 0)
        if back.size and "s" in table.names:
            row = int(segment.start + back[0] + 1)
            findings.add(
                "s",
                f"does not increase at {columns['s'][row]:g} m while v is {columns['v'][row]:g} m/s",
                "write s with more digits, or leave the column out",
                position=table.cell_position(int(rows[row]), "s"),
            )
            return
