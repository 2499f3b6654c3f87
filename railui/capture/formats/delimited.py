"""Delimited text as instruments write it: any encoding, separator, decimal sign and line end, units anywhere."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.capture.formats.clocks import of_columns
from railui.capture.processing.recording import Recording
from railui.io.problems import one_problem
from railui.io.table import MOST_BYTES
from railui.io.units import UnitError, parse_unit

SEPARATORS = (";", "\t", ",", "|")
NAMED = re.compile(r"(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|\s/\s(\S+))?\s*\Z")
LACKING = {"", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "nodata"}
MOST_TITLE = 200  # lines ahead of the numbers


def read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    """One recording; FileProblems with the line of what is no number."""
    text = _decoded(_bytes(path))
    lines = text.split("\n")
    first, separator, comma = _where(path, lines)
    names, units = _header(lines, first, separator)
    rows = _rows(path, lines, first, separator, comma, len(names))
    columns = {name: np.ascontiguousarray(rows[:, i]) for i, name in enumerate(names)}
    return [of_columns(path, columns, dict(zip(names, units, strict=True)), clock, rate)]


def _bytes(path: Path) -> bytes:
    """The file, uncompressed; FileProblems for one that is larger than any recording."""
    with path.open("rb") as file:
        packed = file.read(2) == b"\x1f\x8b"
        file.seek(0)
        with gzip.open(file) if packed else file as stream:
            data = stream.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        what = f"is larger than {MOST_BYTES} bytes uncompressed"
        raise one_problem(path, what, "export the recording in parts")
    return data


def _decoded(data: bytes) -> str:
    """Text with \\n alone: by its byte order mark, as UTF-8, else as Windows writes western Europe."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = data.decode("utf-16")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("cp1252", errors="replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _where(path: Path, lines: list[str]) -> tuple[int, str, bool]:
    """The first line of numbers, the separator, and whether decimals have a comma."""
    for i, line in enumerate(lines[:MOST_TITLE]):
        if line.lstrip().startswith("#") or not line.strip():
            continue
        for separator in SEPARATORS:
            cells = [c.strip().strip('"') for c in line.rstrip(separator).split(separator)]
            if len(cells) < 2 or (separator == "," and ";" in line):
                continue
            comma = separator != "," and any(re.fullmatch(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?", c) for c in cells)
            if all(_is_number(c, comma) for c in cells) and any(c.lower() not in LACKING for c in cells):
                later = [c.strip() for row in lines[i : i + 50] for c in row.split(separator)]
                comma = comma or (separator != "," and any(re.fullmatch(r"[-+]?\d+,\d+", c) for c in later))
                return i, separator, comma
    raise one_problem(path, f"no line of numbers in the first {MOST_TITLE}", "export it as CSV", place=(1, 1))


def _is_number(cell: str, comma: bool) -> bool:
    if cell.lower() in LACKING:
        return True
    try:
        float(cell.replace(",", ".") if comma else cell)
    except ValueError:
        return False
    return "_" not in cell


def _header(lines: list[str], first: int, separator: str) -> tuple[list[str], list[str | None]]:
    """Names and units from the line or the two lines ahead of the numbers."""
    count = len(lines[first].rstrip(separator).split(separator))
    above = [line for line in lines[:first] if line.strip() and not line.lstrip().startswith("#")]
    split = [[c.strip().strip('"') for c in line.split(separator)][:count] for line in above[-2:]]
    split = [cells + [""] * (count - len(cells)) for cells in split if len(cells) > 1 or count == 1]
    if not split:
        return [f"column_{i + 1}" for i in range(count)], [None] * count
    separate = len(split) == 2 and not any("[" in c for c in split[1]) and _are_units(split[1])
    names, units = [], []
    for i, cell in enumerate(split[0] if separate else split[-1]):
        match = NAMED.match(cell)
        name = (match[1] if match else cell).strip() or f"column_{i + 1}"
        names.append(name if name not in names else f"{name}_{i + 1}")
        inside = next((g for g in (match.groups()[1:] if match else ()) if g is not None), None)
        units.append(split[1][i].strip("[]()") if separate else inside)
    return names, units


def _are_units(cells: list[str]) -> bool:
    """Is a line one of units, not of names?"""
    good = 0
    for cell in cells:
        try:
            parse_unit(cell.strip("[]()") or "1")
            good += 1
        except UnitError:
            pass
    return good >= 0.7 * len(cells)


def _rows(path: Path, lines: list[str], first: int, separator: str, comma: bool, count: int) -> FloatArray:
    found: list[list[float]] = []
    for number, line in enumerate(lines[first:], first + 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        cells = [c.strip().strip('"') for c in line.split(separator)]
        if len(cells) == count + 1 and not cells[-1]:
            cells.pop()
        if len(cells) != count:
            if number >= len(lines) - 1:  # the recorder was switched off in the middle of a line
                break
            message = f"has {len(cells)} cells, the first line of numbers has {count}"
            raise one_problem(path, message, "complete or remove the line", place=(number, 1))
        found.append([_number(path, number, c, comma) for c in cells])
    return np.array(found, dtype=np.float64).reshape(len(found), count)


def _number(path: Path, line: int, cell: str, comma: bool) -> float:
    if cell.lower() in LACKING:
        return float("nan")
    try:
        return float(cell.replace(",", ".") if comma else cell)
    except ValueError:
        raise one_problem(path, f"{cell[:40]!r} is no number", "mend or empty it", place=(line, 1)) from None
