"""Reader of tables of the rolling radius difference over displacement."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.io.problems import Findings
from railui.io.table import read_table
from railui.io.units import UnitError, parse_unit

MIN_ROWS = 5
MAX_LENGTH = 0.1  # m, of a displacement or a difference of radii


def read_radius_table(path: str | Path) -> tuple[FloatArray, FloatArray]:
    """Read displacements and r_1 - r_2 [m] of a table `y [mm],delta_r [mm]`, sorted by y; raises FileProblems."""
    table = read_table(path)
    findings = Findings(str(path))
    for name in ("y", "delta_r"):
        if name not in table.names:
            fault = f"has no column {name}, only {', '.join(table.names)}"
            findings.add(name, fault, "write the header `y [mm],delta_r [mm]`", position=table.header_position)
    findings.raise_errors()
    columns = []
    for name in ("y", "delta_r"):
        unit = table.units[table.names.index(name)]
        if unit is None:
            findings.add(name, "has no unit", f"write `{name} [mm]`", position=table.header_position)
            continue
        try:
            columns.append(table.column(name) * _metres_per_unit(unit))
        except UnitError as error:
            findings.add(name, error.message, error.remedy, position=table.header_position)
    findings.raise_errors()
    y, delta = columns
    _check(y, ~np.isfinite(y), findings, table.cell_position, "is not a number")
    _check(delta, ~np.isfinite(delta), findings, table.cell_position, "is not a number")
    for name, values in (("y", y), ("delta_r", delta)):
        beyond = np.flatnonzero(np.abs(values) > MAX_LENGTH)
        if beyond.size:
            fault = f"{values[beyond[0]]:.4g} m is more than the {MAX_LENGTH:g} m of a wheelset"
            place = table.cell_position(int(beyond[0]), name)
            findings.add(name, fault, f"correct the number, or write `{name} [mm]` if they are mm", position=place)
    if len(y) > 1 and y[0] > y[-1]:
        y, delta = y[::-1], delta[::-1]
    else:
        not_increasing = np.concatenate([[False], np.diff(y) <= 0])
        _check(y, not_increasing, findings, table.cell_position, "does not increase")
    if len(y) < MIN_ROWS:
        findings.add("y", f"has {len(y)} rows", f"give {MIN_ROWS} or more", position=table.header_position)
    findings.raise_errors()
    return y, delta


def _check(
    values: FloatArray,
    is_faulty: NDArray[np.bool_],
    findings: Findings,
    position: Callable[[int, str | None], tuple[int, int]],
    fault: str,
) -> None:
    """Report the first faulty value."""
    faulty = np.flatnonzero(is_faulty)
    if len(faulty):
        i = int(faulty[0])
        remedy = "sort the table by y, one row each"
        findings.add("y", f"{values[i] * 1e3:.4g} mm {fault}", remedy, position=position(i, "y"))


def _metres_per_unit(unit: str) -> float:
    """Return the factor to metres; raise UnitError for a unit that is not a length."""
    parsed = parse_unit(unit)
    if parsed.dimension != parse_unit("m").dimension:
        raise UnitError(f"{unit} is not a length", "write [mm]")
    return parsed.factor
