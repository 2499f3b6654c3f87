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

MAX_REPORTED_CELLS = 20  # faulty cells
MISSING_VALUES = frozenset(("", "nan", "na", "n/a", "#n/a", "null", "none"))
DECIMAL_COMMA = ", decimals with a comma need semicolons between the cells"
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


def parse_block(block: bytes, header: Header, line: int, findings: Findings) -> FloatArray:
    """Return the numbers of a block of lines [row, cell]."""
    if b'"' in block:
        return _parse_cell_by_cell(block, header, line, findings)
    plain = block
    if header.separator != ",":
        plain = plain.replace(b",", b".").replace(header.separator.encode(), b",")
    for fill in (False, True):
        part = _parse_with_numpy(EMPTY_CELL.sub(rb"\1nan", plain) if fill else plain)
        if part is not None and part.size == 0:
            return np.empty((0, header.cells))
        if part is not None and part.shape[1] == header.cells:
            return part
    return _parse_cell_by_cell(block, header, line, findings)


def _parse_with_numpy(block: bytes) -> FloatArray | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # a block of comments has no data
            lines = io.BytesIO(block)
            return np.loadtxt(lines, np.float64, delimiter=",", comments="#", ndmin=2, encoding="latin-1")
    except ValueError:
        return None


def _parse_cell_by_cell(block: bytes, header: Header, line: int, findings: Findings) -> FloatArray:
    """Parse every cell; report every fault."""
    rows: list[list[float]] = []
    for number, raw in enumerate(block.decode("latin-1").split("\n"), line):
        text = raw.split("#", 1)[0].strip("\r")
        if not text.strip():
            continue
        try:
            cells = split_cells(text, header.separator)
        except csv.Error as error:
            message = f"cannot be split into cells: {error}"
            findings.add("", message, "close the quotes of each cell", position=(number, 1))
            cells = []
        if cells and len(cells) != header.cells:
            too_many = len(cells) > header.cells and header.separator == ","
            hint = DECIMAL_COMMA if too_many else ""
            findings.add(
                "",
                f"has {len(cells)} cells, the header has {header.cells}",
                f"complete the row{hint}",
                position=(number, 1),
            )
        elif cells:
            places = [(number, column) for column in cell_columns(text, header.separator)]
            places += places[-1:] * len(cells)
            rows.append([_parse_cell(cell, i, header, places[i], findings) for i, cell in enumerate(cells)])
        if len(findings.problems) >= MAX_REPORTED_CELLS:
            break
    return np.array(rows, dtype=np.float64).reshape(len(rows), header.cells)


def _parse_cell(cell: str, i: int, header: Header, position: Position, findings: Findings) -> float:
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
    findings.add(
        name,
        f"{cell.strip()[:40]!r} is not a number",
        "write a number, or leave the cell empty",
        position=position,
    )
    return float("nan")
