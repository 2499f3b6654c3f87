"""A measured run: columns in SI, the unbroken stretches that can be used, and an account of what cannot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.io.atomic import sha256_file
from railui.io.problems import Findings, nearest
from railui.io.table import Table, read_table
from railui.io.units import FAST
from railui.runs.columns import Column, columns_of, named
from railui.runs.segments import Stretches, find_stretches, sampling
from railui.runs.units import own_units, refuse_long, to_si

FASTEST_RIG, MOST_RIG_ROWS = 1e5, 1_000_000


@dataclass(frozen=True, eq=False)
class Run:
    """A run: `columns` by name in SI (rig: in the run's own units), one value per row, NaN where one lacks.

    `rate` [Hz]; `stretches` are slices of unbroken rows; `counts` tells rows, used, stretches, gaps,
    missing_rows, nan_rows, stuck, stuck_rows, standing_rows, short_stretches, unused_rows. `responses` are
    the measured motions, `ignored` the columns that are kept but not used (their numbers stand in `extra`),
    `notes` what a report must say.
    """

    file: Path
    sha256: str
    kind: str
    columns: Mapping[str, FloatArray]
    units: Mapping[str, str]
    rate: float
    stretches: tuple[slice, ...]
    counts: Mapping[str, int]
    responses: tuple[str, ...]
    coach: tuple[str, ...]
    ignored: tuple[str, ...]
    notes: tuple[str, ...]
    extra: Mapping[str, FloatArray]

    def __len__(self) -> int:
        return int(self.columns["t"].size)


def load_run(path: str | Path, kind: str | None = None, *, responses: bool = True) -> Run:
    """Reads a run of a bogie or a rig (`kind` None: told from its columns); FileProblems with every fault.

    `responses` False: a run that only tells the track needs none.
    """
    table = read_table(path)
    findings = Findings(str(path))
    form = kind or kind_of_columns(table.names)
    known = columns_of(form)
    notes: list[str] = []
    columns, units = _columns(table, known, form, findings, notes)
    _required(table, columns, form, findings, responses)
    findings.stop()
    _drop_dead(columns, form, notes, findings, table, responses)
    refuse_long(table, columns, known, findings)
    findings.stop()
    rows = np.flatnonzero(np.isfinite(columns["t"]))
    columns = columns if rows.size == len(table.rows) else {name: column[rows] for name, column in columns.items()}
    rate = sampling(table, columns["t"], rows, findings)
    findings.stop()
    if form == "rig":
        _rig_limits(rate, len(rows), findings)
    _complete(columns, form, notes)
    found = find_stretches(columns, rate, form)
    _usable(found, rate, form, findings)
    _distance_rises(table, columns, found, rows, form, findings)
    findings.stop()
    unknown = tuple(name for name in table.names if name not in known)
    return Run(
        file=Path(path),
        sha256=sha256_file(path),
        kind=form,
        columns=columns,
        units=units,
        rate=rate,
        stretches=found.slices,
        counts=found.counts | {"nan_rows": found.counts["nan_rows"] + len(table.rows) - rows.size},
        responses=tuple(n for n in named(form, "response") if n in columns),
        coach=tuple(n for n in named(form, "coach") if n in columns),
        ignored=unknown,
        notes=tuple(notes),
        extra={name: table.column(name)[rows] for name in unknown},
    )


def kind_of_columns(names: tuple[str, ...]) -> str:
    """A bogie's run, or a rig's: that has no speed and no track but z, vz or az.

    >>> kind_of_columns(("t", "u", "z")), kind_of_columns(("t", "v", "yw", "e1"))
    ('rig', 'bogie')
    """
    rig = not {"v", "yw"} & set(names) and bool(set(named("rig", "response")) & set(names))
    return "rig" if rig else "bogie"


def _columns(
    table: Table, known: Mapping[str, Column], form: str, findings: Findings, notes: list[str]
) -> tuple[dict[str, FloatArray], dict[str, str]]:
    if form == "rig":
        return own_units(table, known, findings, notes)
    return to_si(table, known, findings)


def _required(table: Table, columns: Mapping[str, FloatArray], form: str, findings: Findings, responses: bool) -> None:
    for name in ("t",) if form == "rig" else ("t", "v", "yw"):
        if name not in table.names:
            column = columns_of(form)[name]
            told = nearest(name, [n for n in table.names if n not in columns_of(form)])
            hint = told if told.startswith("did you mean") else f"add `{name} [{column.unit}]`, the {column.caption}"
            findings.add(name, "this column is missing", hint, place=table.header)
    measured = named(form, "response")
    if responses and not set(measured) & set(table.names):
        findings.add("", "no response is measured", f"add at least one of {', '.join(measured)}", place=table.header)


def _drop_dead(
    columns: dict[str, FloatArray], form: str, notes: list[str], findings: Findings, table: Table, responses: bool
) -> None:
    """A channel without one value, or with one value throughout, was not connected."""
    for name in (*named(form, "track", "response", "coach"), "s"):
        column = columns.get(name)
        if column is None:
            continue
        values = column[np.isfinite(column)]
        constant = values.size == 0 or (np.ptp(values) == 0 and (name in named(form, "response") or values[0] != 0))
        if constant and not (form == "rig" and name == "u" and values.size):
            told = "has no value" if values.size == 0 else f"is {values[0]:g} throughout"
            if name == "yw":
                findings.add(name, told, "the track is needed: record it, or give the right column", place=table.header)
            else:
                notes.append(f"{name} {told}: not used")
                del columns[name]
    if form != "rig" and not np.any(np.isfinite(columns["v"])):
        findings.add("v", "has no value", "give the speed", place=table.header)
    if responses and not set(named(form, "response")) & set(columns):
        findings.add("", "no response is alive", "give at least one that moves", place=table.header)


def _complete(columns: dict[str, FloatArray], form: str, notes: list[str]) -> None:
    """Adds what may be absent: s from v, track columns and the input as zero."""
    for name in named(form, "track"):
        if name not in columns:
            columns[name] = np.zeros_like(columns["t"])
            notes.append(f"{name} is absent: taken as 0")
    if form == "rig":
        return
    t, v = columns["t"], columns["v"]
    alive = np.isfinite(v)
    whole = v if alive.all() else np.interp(t, t[alive], v[alive])
    run = np.concatenate(([0.0], np.cumsum(0.5 * (whole[1:] + whole[:-1]) * np.diff(t))))
    if "s" not in columns:
        columns["s"] = run
        notes.append("s is absent: the integral of v")
    else:
        _compare(columns["s"], run, notes)
    if np.median(whole) > FAST:
        notes.append(f"v is {np.median(whole):.4g} m/s in the middle: were km/h meant?")


def _compare(s: FloatArray, run: FloatArray, notes: list[str]) -> None:
    ends = np.flatnonzero(np.isfinite(s))[[0, -1]]
    measured, driven = float(np.diff(s[ends])[0]), float(np.diff(run[ends])[0])
    if driven > 0 and abs(measured / driven - 1) > 0.02:
        notes.append(f"s tells {measured:.6g} m, the integral of v {driven:.6g} m: check the two")


def _rig_limits(rate: float, rows: int, findings: Findings) -> None:
    if rate > FASTEST_RIG * 1.001:
        findings.add("t", f"{rate:.6g} Hz is more than {FASTEST_RIG:g} Hz", "resample the run")
    if rows > MOST_RIG_ROWS:
        findings.add("t", f"{rows} rows are more than {MOST_RIG_ROWS}", "cut the run into parts")


def _usable(found: Stretches, rate: float, form: str, findings: Findings) -> None:
    if not found.slices:
        c = found.counts
        findings.add(
            "",
            f"no stretch of {found.shortest / rate:.4g} s is unbroken ({c['rows']} rows, {c['gaps']} gaps, "
            f"{c['nan_rows']} rows with empty cells, {c['stuck']} times a stuck channel, "
            f"{c['standing_rows']} rows standing)",
            "record longer, or leave out the channel that breaks it",
        )


def _distance_rises(
    table: Table,
    columns: Mapping[str, FloatArray],
    found: Stretches,
    rows: np.ndarray,
    form: str,
    findings: Findings,
) -> None:
    if form == "rig":
        return
    for part in found.slices:
        back = np.flatnonzero(np.diff(columns["s"][part]) <= 0)
        if back.size and "s" in table.names:
            row = int(part.start + back[0] + 1)
            findings.add(
                "s",
                f"stands still or runs back to {columns['s'][row]:g} m while v is {columns['v'][row]:g} m/s",
                "write s with more digits, or leave the column out",
                place=table.place(int(rows[row]), "s"),
            )
            return
