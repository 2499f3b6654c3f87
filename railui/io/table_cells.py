"""Parsing of table cells: with numpy if every cell is a number, else cell by cell with every fault reported."""

from __future__ import annotations

import csv
import io
import re
import warnings
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.io.problems import Findings, Position

MAX_FAULT_KINDS = 20  # that are reported
MAX_FAULTY_ROWS = 100_000  # that are counted
MISSING_VALUES = frozenset(("", "nan", "na", "n/a", "#n/a", "null", "none"))
DECIMAL_COMMA = ", decimals with a comma need semicolons between the cells"
CLOCK_TIME = re.compile(r"\d{1,2}:\d\d(:|\b)")  # of the time of the day, alone or behind a date
EMPTY_CELL = re.compile(rb"(^|,)[ \t]*(?=,|\r?$)", re.MULTILINE)


@dataclass(frozen=True)
class Header:
    """Header line of a table: names, units, separator, number of cells."""

    names: tuple[str, ...]
    units: tuple[str | None, ...]
    column_positions: tuple[int, ...]
    line: int
    comments: tuple[str, ...]
    separator: str
    cells: int


@dataclass
class _CellFault:
    """Fault of one kind: column, position of the first, message, remedy, and number of the rows with it."""

    name: str
    position: Position
    message: str
    remedy: str
    rows: int = 1


class CellFaults:
    """Faults of the cells of a table, one for each kind of fault of a column."""

    def __init__(self) -> None:
        self.faults: dict[tuple[str, str], _CellFault] = {}

    @property
    def are_many(self) -> bool:
        """True where no further rows need to be read."""
        is_counted = any(fault.rows > MAX_FAULTY_ROWS for fault in self.faults.values())
        return is_counted or len(self.faults) >= MAX_FAULT_KINDS

    def add(self, kind: str, name: str, position: Position, message: str, remedy: str) -> None:
        """Add a fault; further ones of its kind in the same column are counted."""
        if (name, kind) in self.faults:
            self.faults[name, kind].rows += 1
        else:
            self.faults[name, kind] = _CellFault(name, position, message, remedy)

    def report(self, findings: Findings) -> None:
        """Add every kind of fault at its first position."""
        for fault in self.faults.values():
            more = f"{'at least ' if self.are_many else ''}{fault.rows - 1} more row{'s' if fault.rows > 2 else ''}"
            rows = f" (and {more})" if fault.rows > 1 else ""
            findings.add(fault.name, fault.message + rows, fault.remedy, position=fault.position)


def split_cells(text: str, separator: str) -> list[str]:
    """Split a line into cells; a cell in quotes may contain the separator. Raises csv.Error for open quotes.

    >>> split_cells('1,"2,5", 3', ",")
    ['1', '2,5', '3']
    """
    rows = list(csv.reader([text], delimiter=separator, skipinitialspace=separator != "\t", strict=True))
    return rows[0] if rows else []


def cell_columns(text: str, separator: str) -> tuple[int, ...]:
    """Return the column, from 1, at which each cell of a line begins.

    >>> cell_columns('a,"b,c",d', ",")
    (1, 3, 9)
    """
    starts, is_quoted = [1], False
    for i, letter in enumerate(text):
        is_quoted ^= letter == '"'
        if letter == separator and not is_quoted:
            starts.append(i + 2)
    return tuple(starts)


def parse_block(block: bytes, header: Header, line: int, faults: CellFaults) -> FloatArray:
    """Return the numbers of a block of lines [row, cell], the first of which is `line`; add its faults."""
    if b'"' in block:
        return _parse_cell_by_cell(block, header, line, faults)
    plain = block
    if header.separator != ",":
        plain = plain.replace(b",", b".").replace(header.separator.encode(), b",")
    for fill in (False, True):
        part = _parse_with_numpy(EMPTY_CELL.sub(rb"\1nan", plain) if fill else plain)
        if part is not None and part.size == 0:
            return np.empty((0, header.cells))
        if part is not None and part.shape[1] == header.cells:
            return part
    return _parse_cell_by_cell(block, header, line, faults)


def _parse_with_numpy(block: bytes) -> FloatArray | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # a block of comments has no data
            lines = io.BytesIO(block)
            return np.loadtxt(lines, np.float64, delimiter=",", comments="#", ndmin=2, encoding="latin-1")
    except ValueError:
        return None


def _parse_cell_by_cell(block: bytes, header: Header, line: int, faults: CellFaults) -> FloatArray:
    """Parse every cell; add every fault."""
    rows: list[list[float]] = []
    for number, raw in enumerate(block.decode("latin-1").split("\n"), line):
        text = raw.split("#", 1)[0].strip("\r")
        if not text.strip():
            continue
        try:
            cells = split_cells(text, header.separator)
        except csv.Error as error:
            message = f"cannot be split into cells: {error}"
            faults.add("quotes", "", (number, 1), message, "close the quotes of each cell")
            cells = []
        if cells and len(cells) != header.cells:
            too_many = len(cells) > header.cells and header.separator == ","
            hint = DECIMAL_COMMA if too_many else ""
            message = f"has {len(cells)} cells, the header has {header.cells}"
            faults.add(hint or message, "", (number, 1), message, f"complete the row{hint}")
        elif cells:
            places = [(number, column) for column in cell_columns(text, header.separator)]
            places += places[-1:] * len(cells)
            rows.append([_parse_cell(cell, i, header, places[i], faults) for i, cell in enumerate(cells)])
        if faults.are_many:
            break
    return np.array(rows, dtype=np.float64).reshape(len(rows), header.cells)


def _parse_cell(cell: str, i: int, header: Header, position: Position, faults: CellFaults) -> float:
    number = cell.strip()
    if header.separator != ",":  # in a quoted cell between commas, a comma may stand between thousands
        number = number.replace(",", ".")
    try:
        if "_" not in number:
            return float(number)
    except ValueError:
        if number.lower() in MISSING_VALUES:
            return float("nan")
    name = header.names[i] if i < len(header.names) else ""
    shown = repr(cell.strip()[:40])
    if CLOCK_TIME.search(number):
        remedy = "make a run of the file by `railui import`, which reads such times, or write seconds"
        faults.add("time", name, position, f"{shown} is a time of the day, not a number", remedy)
    else:
        remedy = "write a number, or leave the cell empty"
        faults.add(shown, name, position, f"{shown} is not a number", remedy)
    return float("nan")
