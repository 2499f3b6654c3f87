"""Segments of a run without gaps, missing values, stuck channels or standstill."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.io.problems import Findings
from railui.io.table import Table
from railui.runs.columns import RIG_FORMS, Form, column_names

INTERVAL_TOLERANCE = 0.01  # relative deviation of a sampling interval
STUCK_DURATION = 1.0  # s
MIN_STUCK_RIG_SAMPLES = 20  # a slow record of a rig repeats values of a coarse sensor
MIN_DURATION = 10.0  # s, of a vehicle's run
MIN_RIG_SAMPLES = 50  # samples; bench tests may last a second
GAP_INTERVALS = 1.5  # intervals
UNUSED = "these rows are not used"


@dataclass(frozen=True)
class Segments:
    """Segments of a run: slices of rows, counts, and the minimum number of rows of a segment."""

    slices: tuple[slice, ...]
    counts: dict[str, int]
    min_samples: int


def sampling_rate(table: Table, t: FloatArray, rows: NDArray[np.intp], findings: Findings) -> float:
    """Return the sampling rate [Hz]; report unordered rows, repeated times and uneven intervals.

    Parameters
    ----------
    table : Table
    t : array [n]
        Times without NaN [s].
    rows : array [n]
        Rows of the table with these times.
    findings : Findings
    """
    if t.size < 3:
        findings.add("t", f"has {t.size} values", "give a run of some seconds at least", position=table.header_position)
        return 1.0
    steps = np.diff(t)
    rising = steps[steps > 0]
    interval = float(np.median(rising)) if rising.size else 0.0
    faults = (
        (steps < 0, "is {b:.9g} s after {a:.9g} s: rows are out of order", "sort the rows by time"),
        (steps == 0, "is {b:.9g} s a second time", "leave the repeated row out, or write t with more digits"),
        (
            (steps > 0) & (abs(steps - interval) > INTERVAL_TOLERANCE * interval) & (steps < GAP_INTERVALS * interval),
            "comes {d:.6g} s after the row before, the interval is {i:.6g} s",
            "resample evenly, or write t with more digits",
        ),
    )
    for mask, message, remedy in faults:
        faulty = np.flatnonzero(mask)
        if faulty.size:
            k = int(faulty[0])
            text = message.format(a=t[k], b=t[k + 1], d=steps[k], i=interval)
            more = f" (and {faulty.size - 1} more rows)" if faulty.size > 1 else ""
            findings.add("t", text + more, remedy, position=table.cell_position(int(rows[k + 1]), "t"))
    if not interval:
        return 1.0
    even = rising[abs(rising - interval) <= INTERVAL_TOLERANCE * interval]
    rate = 1.0 / float(np.mean(even) if even.size else interval)
    return float(round(rate)) if abs(rate - round(rate)) < 1e-6 * rate else rate


def find_segments(columns: Mapping[str, FloatArray], rate: float, form: Form) -> Segments:
    """Return the usable segments of a run, and counts of their interruptions."""
    channels = column_names(form, "track", "response", "coach")
    used = [columns[name] for name in (*column_names(form, "clock"), *channels) if name in columns]
    missing = ~np.all(np.isfinite(used), axis=0)
    stuck, stuck_count = _stuck_rows(
        [columns[name] for name in channels if name in columns and not _may_rest(form, name)],
        stuck_samples(rate, form),
    )
    standing = np.zeros_like(missing) if form in RIG_FORMS else np.nan_to_num(columns["v"], nan=1.0) <= 0
    steps = np.diff(columns["t"]) * rate
    jumps = np.flatnonzero(steps > GAP_INTERVALS)
    good = ~(missing | stuck | standing)
    shortest = MIN_RIG_SAMPLES if form in RIG_FORMS else int(np.ceil(MIN_DURATION * rate * (1 - 1e-6)))
    pieces = _good_ranges(good, jumps)
    segments = tuple(piece for piece in pieces if piece.stop - piece.start >= shortest)
    rows, taken = good.size, sum(piece.stop - piece.start for piece in segments)
    counts = {
        "rows": rows,
        "used": taken,
        "stretches": len(segments),
        "gaps": len(jumps),
        "missing_rows": int(np.sum(np.rint(steps[jumps]) - 1)),
        "nan_rows": int(missing.sum()),
        "stuck": stuck_count,
        "stuck_rows": int(stuck.sum()),
        "standing_rows": int(standing.sum()),
        "short_stretches": len(pieces) - len(segments),
        "unused_rows": rows - taken,
    }
    return Segments(segments, counts, shortest)


def warn_of_interruptions(
    table: Table, columns: Mapping[str, FloatArray], rows: NDArray[np.intp], rate: float, form: Form, findings: Findings
) -> None:
    """Warn of gaps, empty cells, standstill and stuck channels, which interrupt the segments of a run.

    rows: rows of the table of the values of `columns` [n].
    """
    t = columns["t"]

    def warn(name: str, row: int, message: str, remedy: str) -> None:
        findings.warn(name, message, remedy, position=table.cell_position(int(rows[row]), name))

    steps = np.diff(t)
    jumps = np.flatnonzero(steps * rate > GAP_INTERVALS)
    if jumps.size:
        k = int(jumps[np.argmax(steps[jumps])])
        many = f"{jumps.size} gaps, the longest" if jumps.size > 1 else "a gap"
        remedy = "the run goes on behind a gap as another segment; record without pauses if none was intended"
        warn("t", k + 1, f"has {many} of {steps[k]:.4g} s from {t[k]:.6g} s on", remedy)
    channels = [name for name in column_names(form, "track", "response", "coach") if name in columns]
    empty: dict[bytes, list[str]] = {}
    for name in [*(name for name in column_names(form, "clock") if name in columns), *channels]:
        empty.setdefault(np.isnan(columns[name]).tobytes(), []).append(name)
    for names in empty.values():
        if (missing := np.flatnonzero(np.isnan(columns[names[0]]))).size:
            number = f"{missing.size} row{'s' * (missing.size > 1)}"
            subject = "has no value" if len(names) == 1 else f"and {', '.join(names[1:])} have no value"
            remedy = f"{UNUSED}; leave a column out that fails often"
            warn(names[0], int(missing[0]), f"{subject} in {number}, first at {t[missing[0]]:.6g} s", remedy)
    if form not in RIG_FORMS and (standing := np.flatnonzero(columns["v"] <= 0)).size:
        message = f"is 0 or less in {standing.size} row{'s' * (standing.size > 1)}, first at {t[standing[0]]:.6g} s"
        warn("v", int(standing[0]), message, f"{UNUSED} as a standstill: correct v if the vehicle moved")
    for name in channels:
        stuck = [] if _may_rest(form, name) else _stuck_parts(columns[name], stuck_samples(rate, form))
        if stuck:
            first, end = max(stuck, key=lambda part: part[1] - part[0])
            many = f"{len(stuck)} times, the longest" if len(stuck) > 1 else "once,"
            message = f"is stuck {many} at {columns[name][first]:.4g} for {(end - first) / rate:.3g} s"
            warn(
                name, first, f"{message} from {t[first]:.6g} s on", f"{UNUSED}; leave the column out if it fails often"
            )


def _may_rest(form: Form, name: str) -> bool:
    """True for the input of a rig and the motion of a bench, which may rest on purpose."""
    return (form == "rig" and name == "u") or (form == "bench" and name in ("z", "vz"))


def stuck_samples(rate: float, form: Form) -> int:
    """Return the number of equal samples in a row from which a channel is stuck: those of 1 s, of a rig at least 20.

    >>> stuck_samples(200.0, "bogie"), stuck_samples(200.0, "rig"), stuck_samples(0.25, "rig")
    (200, 200, 20)
    """
    return max(round(STUCK_DURATION * rate), MIN_STUCK_RIG_SAMPLES if form in RIG_FORMS else 2)


def _stuck_rows(columns: list[FloatArray], longest: int) -> tuple[NDArray[np.bool_], int]:
    """Return the rows in which a channel has one value for so many samples, and the number of such events."""
    size = columns[0].size if columns else 0
    stuck, count = np.zeros(size, dtype=bool), 0
    for column in columns:
        parts = _stuck_parts(column, longest)
        for first, end in parts:
            stuck[first:end] = True
        count += len(parts)
    return stuck, count


def _stuck_parts(column: FloatArray, longest: int) -> list[tuple[int, int]]:
    """Return the first row and the end of every part in which a column [n] has one value for so many samples."""
    if not np.any(column):
        return []  # zero throughout: an absent track column, or a coach without force
    edges = np.flatnonzero(np.diff(column) != 0) + 1  # NaN differs from everything
    bounds = np.concatenate(([0], edges, [column.size]))
    return [(int(bounds[k]), int(bounds[k + 1])) for k in np.flatnonzero(np.diff(bounds) >= longest)]


def _good_ranges(good: NDArray[np.bool_], jumps: NDArray[np.intp]) -> list[slice]:
    """Return the ranges of good rows, split after each row of `jumps`."""
    if not good.size:
        return []
    cut = np.zeros(good.size, dtype=bool)
    cut[jumps + 1] = True
    starts = np.flatnonzero(good & (cut | ~np.concatenate(([False], good[:-1]))))
    ends = np.flatnonzero(good & (np.concatenate((cut[1:], [True])) | ~np.concatenate((good[1:], [False])))) + 1
    return [slice(int(a), int(b)) for a, b in zip(starts, ends, strict=True)]
