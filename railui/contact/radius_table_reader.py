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


def read_radius_table(path: str | Path) -> tuple[FloatArray, FloatArray]:
    """Displacements and r_1 - r_2 [m] of a table `y [mm],delta_r [mm]`, sorted by y. FileProblems with the line."""
    table = read_table(path)
    findings = Findings(str(path))
    for name in ("y", "delta_r"):
        if name not in table.names:
            told = f"has no column {name}, only {', '.join(table.names)}"
            findings.add(name, told, "write the header `y [mm],delta_r [mm]`", position=table.header_position)
    findings.raise_errors()
    columns = []
    for name in ("y", "delta_r"):
        unit = table.units[table.names.index(name)]
        if unit is None:
            findings.add(name, "has no unit", f"write `{name} [mm]`", position=table.header_position)
            continue
        try:
            columns.append(table.column(name) * _length(unit))
        except UnitError as error:
            findings.add(name, error.message, error.remedy, position=table.header_position)
    findings.raise_errors()
    y, delta = columns
    _checked(y, findings, table.cell_position, lambda v: ~np.isfinite(v), "is not a number")
    _checked(delta, findings, table.cell_position, lambda v: ~np.isfinite(v), "is not a number")
    if len(y) > 1 and y[0] > y[-1]:
        y, delta = y[::-1], delta[::-1]
    else:
        _checked(y[1:], findings, lambda i, n: table.cell_position(i + 1, n), lambda v: np.diff(y) <= 0, "does not rise")
    if len(y) < 5:
        findings.add("y", f"has {len(y)} rows", "give five or more", position=table.header_position)
    findings.raise_errors()
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
        findings.add("y", f"{values[i] * 1e3:.4g} mm {what}", "sort the table by y, one row each", position=place(i, "y"))


def _length(unit: str) -> float:
    parsed = parse_unit(unit)
    if parsed.dimension != parse_unit("m").dimension:
        raise UnitError(f"{unit} is no length", "write [mm]")
    return parsed.factor
