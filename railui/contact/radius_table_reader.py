"""Reading tables of the rolling radius difference against displacement."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.io.problems import Findings
from railui.io.table import read_table
from railui.io.units import UnitError, parse_unit


def read_delta_r(path: str | Path) -> tuple[FloatArray, FloatArray]:
    """Displacements and r_1 - r_2 [m] of a table `y [mm],delta_r [mm]`, sorted by y. FileProblems with the line."""
    table = read_table(path)
    findings = Findings(str(path))
    for name in ("y", "delta_r"):
        if name not in table.names:
            told = f"has no column {name}, only {', '.join(table.names)}"
            findings.add(name, told, "write the header `y [mm],delta_r [mm]`", place=table.header)
    findings.stop()
    columns = []
    for name in ("y", "delta_r"):
        unit = table.units[table.names.index(name)]
        if unit is None:
            findings.add(name, "has no unit", f"write `{name} [mm]`", place=table.header)
            continue
        try:
            columns.append(table.column(name) * _length(unit))
        except UnitError as error:
            findings.add(name, error.message, error.remedy, place=table.header)
    findings.stop()
    y, delta = columns
    _checked(y, findings, table.place, lambda v: ~np.isfinite(v), "is not a number")
    _checked(delta, findings, table.place, lambda v: ~np.isfinite(v), "is not a number")
    if len(y) > 1 and y[0] > y[-1]:
        y, delta = y[::-1], delta[::-1]
    else:
        _checked(y[1:], findings, lambda i, n: table.place(i + 1, n), lambda v: np.diff(y) <= 0, "does not rise")
    if len(y) < 5:
        findings.add("y", f"has {len(y)} rows", "give five or more", place=table.header)
    findings.stop()
    return y, delta


def _checked(
    values: FloatArray,
    findings: Findings,
    place: Callable[[int, str | None], tuple[int, int]],
    bad: Callable[[FloatArray], NDArray[np.bool_]],
    what: str,
) -> None:
    found = np.flatnonzero(bad(values))
    if len(found):
        i = int(found[0])
        findings.add("y", f"{values[i] * 1e3:.4g} mm {what}", "sort the table by y, one row each", place=place(i, "y"))


def _length(unit: str) -> float:
    parsed = parse_unit(unit)
    if parsed.dimension != parse_unit("m").dimension:
        raise UnitError(f"{unit} is no length", "write [mm]")
    return parsed.factor
