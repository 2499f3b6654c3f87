"""Unbroken stretches of a run: what a gap, an empty cell, a stuck channel or a halt leaves over."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.io.problems import Findings
from railui.io.table import Table
from railui.runs.columns import named

UNEVEN = 0.01  # share of the interval by which one may differ
STUCK = 1.0  # s
SHORTEST = 10.0  # s, of a vehicle's run
SHORTEST_RIG = 50  # samples: bench tests may last a second
GAP = 1.5  # intervals


@dataclass(frozen=True)
class Stretches:
    """Slices of rows, what was counted, and the fewest rows of a stretch."""

    slices: tuple[slice, ...]
    counts: dict[str, int]
    shortest: int


def sampling(table: Table, t: FloatArray, rows: NDArray[np.intp], findings: Findings) -> float:
    """The sampling rate [Hz]; tells rows out of order, repeated stamps and uneven intervals by their lines.

    `t` [s] without NaN; `rows` are the rows of the table that it comes from.
    """
    if t.size < 3:
        findings.add("t", f"has {t.size} values", "give a run of some seconds at least", place=table.header)
        return 1.0
    steps = np.diff(t)
    rising = steps[steps > 0]
    interval = float(np.median(rising)) if rising.size else 0.0
    faults = (
        (steps < 0, "is {b:.9g} s after {a:.9g} s: rows are out of order", "sort the rows by time"),
        (steps == 0, "is {b:.9g} s a second time", "leave the repeated row out, or write t with more digits"),
        (
            (steps > 0) & (abs(steps - interval) > UNEVEN * interval) & (steps < GAP * interval),
            "comes {d:.6g} s after the row before, the interval is {i:.6g} s",
            "resample evenly, or write t with more digits",
        ),
    )
    for mask, message, remedy in faults:
        found = np.flatnonzero(mask)
        if found.size:
            k = int(found[0])
            told = message.format(a=t[k], b=t[k + 1], d=steps[k], i=interval)
            more = f" (and {found.size - 1} more rows)" if found.size > 1 else ""
            findings.add("t", told + more, remedy, place=table.place(int(rows[k + 1]), "t"))
    if not interval:
        return 1.0
    even = rising[abs(rising - interval) <= UNEVEN * interval]
    rate = 1.0 / float(np.mean(even) if even.size else interval)
    return float(round(rate)) if abs(rate - round(rate)) < 1e-6 * rate else rate


def find_stretches(columns: Mapping[str, FloatArray], rate: float, form: str) -> Stretches:
    """The usable stretches of a run that is in order, and the count of what ends them."""
    watched = named(form, "track", "response", "coach")
    used = [columns[name] for name in (*named(form, "clock"), *watched) if name in columns]
    lacking = ~np.all(np.isfinite(used), axis=0)
    stuck, times = _stuck(
        [columns[name] for name in watched if name in columns and not (form == "rig" and name == "u")], rate
    )
    standing = np.zeros_like(lacking) if form == "rig" else np.nan_to_num(columns["v"], nan=1.0) <= 0
    steps = np.diff(columns["t"]) * rate
    jumps = np.flatnonzero(steps > GAP)
    good = ~(lacking | stuck | standing)
    shortest = SHORTEST_RIG if form == "rig" else int(np.ceil(SHORTEST * rate * (1 - 1e-6)))
    pieces = _pieces(good, jumps)
    kept = tuple(piece for piece in pieces if piece.stop - piece.start >= shortest)
    rows, taken = good.size, sum(piece.stop - piece.start for piece in kept)
    counts = {
        "rows": rows,
        "used": taken,
        "stretches": len(kept),
        "gaps": len(jumps),
        "missing_rows": int(np.sum(np.rint(steps[jumps]) - 1)),
        "nan_rows": int(lacking.sum()),
        "stuck": times,
        "stuck_rows": int(stuck.sum()),
        "standing_rows": int(standing.sum()),
        "short_stretches": len(pieces) - len(kept),
        "unused_rows": rows - taken,
    }
    return Stretches(kept, counts, shortest)


def _stuck(columns: list[FloatArray], rate: float) -> tuple[NDArray[np.bool_], int]:
    """Rows in which some channel holds one value for 1 s, and how many times that happens."""
    size = columns[0].size if columns else 0
    stuck, times = np.zeros(size, dtype=bool), 0
    longest = max(round(STUCK * rate), 2)
    for column in columns:
        if not np.any(column):
            continue  # zero throughout: an absent track column, or a coach that does not push
        edges = np.flatnonzero(np.diff(column) != 0) + 1  # NaN differs from everything
        bounds = np.concatenate(([0], edges, [size]))
        for k in np.flatnonzero(np.diff(bounds) >= longest):
            stuck[bounds[k] : bounds[k + 1]] = True
            times += 1
    return stuck, times


def _pieces(good: NDArray[np.bool_], jumps: NDArray[np.intp]) -> list[slice]:
    """Runs of good rows, cut behind each row of `jumps`."""
    if not good.size:
        return []
    cut = np.zeros(good.size, dtype=bool)
    cut[jumps + 1] = True
    starts = np.flatnonzero(good & (cut | ~np.concatenate(([False], good[:-1]))))
    ends = np.flatnonzero(good & (np.concatenate((cut[1:], [True])) | ~np.concatenate((good[1:], [False])))) + 1
    return [slice(int(a), int(b)) for a, b in zip(starts, ends, strict=True)]
