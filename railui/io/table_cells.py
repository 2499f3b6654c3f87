"""Parsing of table cells: with numpy if every cell is a number, else cell by cell with every fault reported."""

from __future__ import annotations

import io
import re
import warnings
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.io.problems import Findings

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


def parse_block(block: bytes, header: Header, line: int, findings: Findings) -> FloatArray:
    """Return the numbers of a block of lines [row, cell]."""
    plain = block.replace(b'"', b"") if b'"' in block else block
    if header.separator == ";":
        plain = plain.replace(b",", b".").replace(b";", b",")
    elif header.separator == "\t":
        plain = plain.replace(b",", b".").replace(b"\t", b",")
    for fill in (False, True):
        part = _parse_with_numpy(EMPTY_CELL.sub(rb"\1nan", plain) if fill else plain)
        if part is not None and part.size == 0:
            return np.empty((0, header.cells))
        if part is not None and part.shape[1] == header.cells:
            return part
    return _parse_cell_by_cell(plain, header, line, findings)


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
        cells = text.split(",")
        if len(cells) != header.cells:
            too_many = len(cells) > header.cells and header.separator == ","
            hint = DECIMAL_COMMA if too_many else ""
            findings.add(
                "",
                f"has {len(cells)} cells, the header has {header.cells}",
                f"complete the row{hint}",
                position=(number, 1),
            )
        else:
            rows.append([_parse_cell(cell, i, cells, header, number, findings) for i, cell in enumerate(cells)])
        if len(findings.problems) >= MAX_REPORTED_CELLS:
            break
    return np.array(rows, dtype=np.float64).reshape(len(rows), header.cells)


def _parse_cell(cell: str, i: int, cells: list[str], header: Header, line: int, findings: Findings) -> float:
    try:
        if "_" not in cell:
            return float(cell)
    except ValueError:
        if cell.strip().lower() in MISSING_VALUES:
            return float("nan")
    column = sum(len(c) + 1 for c in cells[:i]) + 1
    name = header.names[i] if i < len(header.names) else ""
    findings.add(
        name,
        f"{cell.strip()[:40]!r} is not a number",
        "write a number, or leave the cell empty",
        position=(line, column),
    )
    return float("nan")
