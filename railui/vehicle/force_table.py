"""Force tables of a component: damper force over velocity, spring force over displacement, from lists or a CSV."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.io.problems import FileProblems, Findings, Position, suggest_name
from railui.io.table import Table, read_table
from railui.io.units import UnitError, convert, quantity
from railui.io.yaml_nodes import join_path
from railui.vehicle.effects import PlacedEffect

MIN_ROWS, MAX_ROWS = 2, 200
FORCE_UNITS: Final = {"m": "N", "rad": "N*m"}
SYMMETRIC, FILE, FORCE = "symmetric", "file", "force"
TABLE_HINT: Final = "write {file: CSV}, or two lists of numbers"


@dataclass(frozen=True)
class TableKind:
    """Kind of a table: key of the element, key and unit of the abscissa, column of a CSV, abscissa of the curve."""

    key: str
    abscissa: str
    per_second: bool
    column: str

    def unit(self, motion: str) -> str:
        """Return the unit of the abscissa of a component that moves in m or rad."""
        return f"{motion}/s" if self.per_second else motion

    def header(self, motion: str) -> str:
        """Return the header of its CSV."""
        return f"{self.column} [{self.unit(motion)}],F [{FORCE_UNITS[motion]}]"


DAMPER: Final = TableKind("damper", "velocity", True, "v")
SPRING: Final = TableKind("spring", "displacement", False, "z")
TABLE_KINDS: Final = (DAMPER, SPRING)


@dataclass
class _Points:
    """Points of a table, with the place of each for the report of a problem."""

    x: FloatArray
    force: FloatArray
    findings: Findings
    paths: tuple[str, str]
    table: Table | None = None
    columns: tuple[str, str] = ("", "")

    def add(self, row: int | None, what: str, remedy: str, of_force: bool = False) -> None:
        """Add a problem of a row, or of the whole table."""
        if self.table is None:
            path = self.paths[of_force]
            self.findings.add(path if row is None else join_path(path, str(row)), what, remedy)
            return
        name = self.columns[of_force]
        position: Position = self.table.header_position if row is None else self.table.cell_position(row, name)
        self.findings.add(name, what, remedy, position=position)


def read_force_table(
    raw: Any, kind: TableKind, motion: str, findings: Findings, path: str, directory: Path | None, at: str
) -> PlacedEffect | None:
    """Read a force table: a file name, `{file: damper.csv}` or `{velocity: [...], force: [...]}`, or `symmetric` too.

    Parameters
    ----------
    raw : object
        Value of the key in the file. The force resists: it is positive at a positive velocity or displacement.
    kind : TableKind
    motion : str
        Unit of the motion, m or rad.
    findings : Findings
        Receives every problem; those of a CSV have their line.
    path : str
        Path of the value in its file.
    directory : Path, optional
        Directory to which a file name is relative.
    at : str
        Location of the effect.

    Returns
    -------
    PlacedEffect or None
        A curve, linear between the points and constant beyond them; None where there are problems.
    """
    before = len(findings.problems)
    entry = {FILE: raw} if isinstance(raw, str) else raw
    if not isinstance(entry, Mapping):
        findings.add(path, "is not a table", TABLE_HINT)
        return None
    known = (kind.abscissa, FORCE, FILE, SYMMETRIC)
    for key in entry:
        if key not in known:
            findings.add(join_path(path, str(key)), "unknown key of a table", suggest_name(str(key), known), key=True)
    is_symmetric = entry.get(SYMMETRIC, False)
    if not isinstance(is_symmetric, bool):
        findings.add(join_path(path, SYMMETRIC), f"{is_symmetric!r} is not a switch", "write true or false")
    if len(findings.problems) > before:
        return None
    points = _points(entry, kind, motion, findings, path, directory)
    if points is None or len(findings.problems) > before:
        return None
    _check(points, kind, bool(is_symmetric))
    findings.problems += [] if points.findings is findings else points.findings.problems
    if len(findings.problems) > before:
        return None
    x, force = _mirrored(points.x, points.force) if is_symmetric else (points.x, points.force)
    curve = {"motion": tuple(map(float, x)), "force": tuple(map(float, -force))}  # the kernel's acts on the body
    return PlacedEffect("measured_force", at, None, curve, "v" if kind.per_second else "z")


def _points(
    entry: Mapping[str, Any], kind: TableKind, motion: str, findings: Findings, path: str, directory: Path | None
) -> _Points | None:
    lists = [key for key in (kind.abscissa, FORCE) if key in entry]
    if FILE in entry:
        if lists:
            findings.add(join_path(path, lists[0]), f"and {FILE} are both given", "leave one of them out", key=True)
            return None
        return _points_of_file(str(entry[FILE]), kind, motion, findings, join_path(path, FILE), directory)
    if len(lists) < 2:
        missing = FORCE if kind.abscissa in lists else kind.abscissa
        remedy = f"add `{missing}: [...]`" if lists else TABLE_HINT
        findings.add(path, f"has no {missing}", remedy)
        return None
    paths = (join_path(path, kind.abscissa), join_path(path, FORCE))
    x = _numbers(entry[kind.abscissa], kind.unit(motion), findings, paths[0])
    force = _numbers(entry[FORCE], FORCE_UNITS[motion], findings, paths[1])
    if x is None or force is None:
        return None
    if len(x) != len(force):
        findings.add(paths[1], f"has {len(force)} values, {kind.abscissa} has {len(x)}", "give one force per point")
        return None
    return _Points(x, force, findings, paths)


def _numbers(raw: Any, unit: str, findings: Findings, path: str) -> FloatArray | None:
    if not isinstance(raw, list):
        findings.add(path, "is not a list", "write [one, two, ...]")
        return None
    values = []
    for i, value in enumerate(raw):
        try:
            values.append(quantity(value, unit))
        except UnitError as error:
            findings.add(join_path(path, str(i)), error.message, error.remedy)
    return np.array(values, dtype=float) if len(values) == len(raw) else None


def _points_of_file(
    name: str, kind: TableKind, motion: str, findings: Findings, path: str, directory: Path | None
) -> _Points | None:
    file = (directory or Path()) / name
    if not file.is_file():
        near = sorted(p.name for p in file.parent.glob("*.csv")) if file.parent.is_dir() else []
        remedy = suggest_name(file.name, near) if near else f"write a CSV with the header `{kind.header(motion)}`"
        findings.add(path, f"no file {name!r}", remedy)
        return None
    try:
        table = read_table(file)
    except FileProblems as error:
        findings.problems += error.problems
        return None
    in_file = Findings(str(file))
    columns = [
        _column(table, column, unit, kind.header(motion), in_file)
        for column, unit in ((kind.column, kind.unit(motion)), ("F", FORCE_UNITS[motion]))
    ]
    findings.problems += in_file.problems
    if columns[0] is None or columns[1] is None:
        return None
    return _Points(columns[0], columns[1], Findings(str(file)), ("", ""), table, (kind.column, "F"))


def _column(table: Table, name: str, unit: str, header: str, findings: Findings) -> FloatArray | None:
    """Return a column in SI; report a missing one and a unit that does not fit."""
    if name not in table.names:
        what = f"has no column {name}, only {', '.join(table.names)}"
        findings.add(name, what, f"write the header `{header}`", position=table.header_position)
        return None
    given = table.units[table.names.index(name)]
    if given is None:
        findings.add(name, "has no unit", f"write the header `{header}`", position=table.header_position)
        return None
    try:
        return np.asarray(table.column(name) * convert(1.0, given, unit))
    except UnitError as error:
        findings.add(name, error.message, error.remedy, position=table.header_position)
        return None


def table_motion(path: Path, findings: Findings) -> tuple[TableKind, str] | None:
    """Return the kind of the table in a CSV and the unit of its motion, m or rad; None where it is none."""
    try:
        table = read_table(path)
    except FileProblems as error:
        findings.problems += error.problems
        return None
    header = DAMPER.header("m")
    if "t" in table.names:
        remedy = f"write a table with the header `{header}`, or identify the component: railui loop"
        findings.add("t", "is a recording over time, not a table", remedy, position=table.header_position)
        return None
    kind = next((kind for kind in TABLE_KINDS if kind.column in table.names), None)
    if kind is None:
        what = f"has neither a column v nor z, only {', '.join(table.names)}"
        findings.add("", what, f"write the header `{header}`", position=table.header_position)
        return None
    unit = table.units[table.names.index(kind.column)] or ""
    for motion in FORCE_UNITS:
        try:
            convert(1.0, unit, kind.unit(motion))
            return kind, motion
        except UnitError:
            continue
    what = f"[{unit}] is no unit of a {kind.abscissa}" if unit else "has no unit"
    findings.add(kind.column, what, f"write the header `{header}`", position=table.header_position)
    return None


def _check(points: _Points, kind: TableKind, is_symmetric: bool) -> None:
    """Report points that do not increase, are not finite or too few, and a force that drives instead of resisting."""
    x, force = points.x, points.force
    if not MIN_ROWS <= len(x) <= MAX_ROWS:
        points.add(None, f"the table has {len(x)} points", f"give {MIN_ROWS} to {MAX_ROWS}")
        return
    for values, of_force in ((x, False), (force, True)):
        faulty = np.flatnonzero(~np.isfinite(values))
        if faulty.size:
            points.add(int(faulty[0]), "is not a number", "fill it, or leave the point out", of_force)
            return
    steps = np.flatnonzero(np.diff(x) <= 0)
    if steps.size:
        points.add(int(steps[0]) + 1, f"{kind.abscissa} does not increase", "sort the points, each value once")
    elif is_symmetric and x[0] < 0:
        points.add(0, f"a symmetric table has a negative {kind.abscissa}", "give one side, or leave `symmetric` out")
    elif is_symmetric and x[0] == 0 and force[0] != 0:
        points.add(0, "a symmetric force is 0 at 0", "write 0, or begin at the first point above 0", of_force=True)
    elif not is_symmetric and x[0] >= 0:
        remedy = "give both directions, or `symmetric: true`"
        points.add(None, f"the table has no negative {kind.abscissa}", remedy)
    elif force[-1] < force[0]:
        what = f"the force falls from {force[0]:g} to {force[-1]:g}: it drives the motion instead of resisting it"
        points.add(None, what, f"change the sign: F > 0 at {kind.abscissa} > 0", of_force=True)


def _mirrored(x: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a table with its mirror image at the origin, F(-x) = -F(x).

    >>> _mirrored(np.array([0.0, 0.1]), np.array([0.0, 500.0]))[1].tolist()
    [-500.0, 0.0, 500.0]
    """
    one_side = x > 0
    mirrored = np.concatenate([-x[one_side][::-1], [0.0], x[one_side]])
    return mirrored, np.concatenate([-force[one_side][::-1], [0.0], force[one_side]])


def table_schema(kind: TableKind) -> Mapping[str, Any]:
    """Return the JSON Schema of a table in an element."""
    numbers = {"type": "array", "items": {"type": ["number", "string"]}, "minItems": MIN_ROWS, "maxItems": MAX_ROWS}
    lists: dict[str, Any] = {kind.abscissa: numbers, FORCE: numbers}
    symmetric = {SYMMETRIC: {"type": "boolean", "description": "F(-x) = -F(x): one side is given"}}

    def group(properties: dict[str, Any]) -> dict[str, Any]:
        return {
            "type": "object",
            "properties": properties | symmetric,
            "required": list(properties),
            "additionalProperties": False,
        }

    return {"oneOf": [{"type": "string"}, group(lists), group({FILE: {"type": "string"}})]}


def read_tables(
    data: Mapping[str, Any], motion: str, findings: Findings, path: str, directory: Path | None, at: str
) -> Sequence[PlacedEffect]:
    """Read the tables of an element."""
    tables = [
        read_force_table(data[kind.key], kind, motion, findings, join_path(path, kind.key), directory, at)
        for kind in TABLE_KINDS
        if data.get(kind.key) is not None
    ]
    return [table for table in tables if table is not None]
