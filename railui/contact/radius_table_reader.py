"""Reader of tables of the rolling radius difference over displacement."""

from __future__ import annotations

from pathlib import Path

import numpy as np

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
    for name, values in (("y", y), ("delta_r", delta)):
        missing = np.flatnonzero(~np.isfinite(values))
        if missing.size:
            place = table.cell_position(int(missing[0]), name)
            findings.add(name, "is not a number", "give a number in each row", position=place)
    for name, values in (("y", y), ("delta_r", delta)):
        beyond = np.flatnonzero(np.abs(values) > MAX_LENGTH)
        if beyond.size:
            fault = f"{values[beyond[0]]:.4g} m is more than the {MAX_LENGTH:g} m of a wheelset"
            place = table.cell_position(int(beyond[0]), name)
            findings.add(name, fault, f"correct the number, or write `{name} [mm]` if they are mm", position=place)
    is_descending = len(y) > 1 and y[0] > y[-1]
    unordered = np.flatnonzero(np.diff(-y if is_descending else y) <= 0) + 1
    if unordered.size:
        i = int(unordered[0])
        fault = f"{y[i] * 1e3:.4g} mm does not {'decrease' if is_descending else 'increase'}"
        findings.add("y", fault, "sort the table by y, one row each", position=table.cell_position(i, "y"))
    if len(y) < MIN_ROWS:
        findings.add("y", f"has {len(y)} rows", f"give {MIN_ROWS} or more", position=table.header_position)
    findings.raise_errors()
    return (y[::-1], delta[::-1]) if is_descending else (y, delta)


def _metres_per_unit(unit: str) -> float:
    """Return the factor to metres; raise UnitError for a unit that is not a length."""
    parsed = parse_unit(unit)
    if parsed.dimension != parse_unit("m").dimension:
        raise UnitError(f"{unit} is not a length", "write [mm]")
    return parsed.factor
