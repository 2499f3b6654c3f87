"""Delimited text of instruments: any encoding, separator, decimal sign and line end, units in the header."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.capture.formats.time_base import recording_from_columns
from railui.capture.processing.recording import Recording
from railui.io.problems import file_problem
from railui.io.table import MAX_BYTES
from railui.io.units import UnitError, parse_unit

SEPARATORS = (";", "\t", ",", "|")
HEADER_PATTERN = re.compile(r"(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|\s/\s(\S+))?\s*\Z")
MISSING_VALUES = {"", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "nodata"}
MAX_HEADER_LINES = 200
MIN_UNIT_SHARE = 0.7  # of the cells of a line of units
DECIMAL_COMMA_LINES = 50  # lines searched for a decimal comma


def read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    """Read one recording; raise FileProblems with the line of a cell that is not a number."""
    text = _decode(_read_bytes(path))
    lines = text.split("\n")
    first, separator, comma = _find_numbers(path, lines)
    names, units = _read_header(lines, first, separator)
    rows = _read_rows(path, lines, first, separator, comma, len(names))
    columns = {name: np.ascontiguousarray(rows[:, i]) for i, name in enumerate(names)}
    return [recording_from_columns(path, columns, dict(zip(names, units, strict=True)), clock, rate)]


def _read_bytes(path: Path) -> bytes:
    """Read and uncompress the file; raise FileProblems if it is larger than supported."""
    with path.open("rb") as file:
        is_packed = file.read(2) == b"\x1f\x8b"
        file.seek(0)
        with gzip.open(file) if is_packed else file as stream:
            data = stream.read(MAX_BYTES + 1)
    if len(data) > MAX_BYTES:
        message = f"is larger than {MAX_BYTES} bytes uncompressed"
        raise file_problem(path, message, "export the recording in parts")
    return data


def _decode(data: bytes) -> str:
    """Decode by the byte order mark, as UTF-8, else as Windows-1252; convert line ends to \\n."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = data.decode("utf-16")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("cp1252", errors="replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _find_numbers(path: Path, lines: list[str]) -> tuple[int, str, bool]:
    """Find the first line of numbers, the separator, and whether decimals have a comma."""
    for i, line in enumerate(lines[:MAX_HEADER_LINES]):
        if line.lstrip().startswith("#") or not line.strip():
            continue
        for separator in SEPARATORS:
            cells = [c.strip().strip('"') for c in line.rstrip(separator).split(separator)]
            if len(cells) < 2 or (separator == "," and ";" in line):
                continue
            comma = separator != "," and any(re.fullmatch(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?", c) for c in cells)
            if all(_is_number(c, comma) for c in cells) and any(c.lower() not in MISSING_VALUES for c in cells):
                later = [c.strip() for row in lines[i : i + DECIMAL_COMMA_LINES] for c in row.split(separator)]
                comma = comma or (separator != "," and any(re.fullmatch(r"[-+]?\d+,\d+", c) for c in later))
                return i, separator, comma
    raise file_problem(
        path, f"no line of numbers in the first {MAX_HEADER_LINES} lines", "export it as CSV", position=(1, 1)
    )


def _is_number(cell: str, comma: bool) -> bool:
    if cell.lower() in MISSING_VALUES:
        return True
    try:
        float(cell.replace(",", ".") if comma else cell)
    except ValueError:
        return False
    return "_" not in cell


def _read_header(lines: list[str], first: int, separator: str) -> tuple[list[str], list[str | None]]:
    """Read names and units from the line or the two lines above the numbers."""
    count = len(lines[first].rstrip(separator).split(separator))
    above = [line for line in lines[:first] if line.strip() and not line.lstrip().startswith("#")]
    split = [[c.strip().strip('"') for c in line.split(separator)][:count] for line in above[-2:]]
    split = [cells + [""] * (count - len(cells)) for cells in split if len(cells) > 1 or count == 1]
    if not split:
        return [f"column_{i + 1}" for i in range(count)], [None] * count
    has_unit_line = len(split) == 2 and not any("[" in c for c in split[1]) and _are_units(split[1])
    names, units = [], []
    for i, cell in enumerate(split[0] if has_unit_line else split[-1]):
        match = HEADER_PATTERN.match(cell)
        name = (match[1] if match else cell).strip() or f"column_{i + 1}"
        names.append(name if name not in names else f"{name}_{i + 1}")
        inside = next((g for g in (match.groups()[1:] if match else ()) if g is not None), None)
        units.append(split[1][i].strip("[]()") if has_unit_line else inside)
    return names, units


def _are_units(cells: list[str]) -> bool:
    """Return True if a line consists of units, not of names."""
    unit_count = 0
    for cell in cells:
        try:
            parse_unit(cell.strip("[]()") or "1")
            unit_count += 1
        except UnitError:
            pass
    return unit_count >= MIN_UNIT_SHARE * len(cells)


def _read_rows(path: Path, lines: list[str], first: int, separator: str, comma: bool, count: int) -> FloatArray:
    rows: list[list[float]] = []
    for number, line in enumerate(lines[first:], first + 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        cells = [c.strip().strip('"') for c in line.split(separator)]
        if len(cells) == count + 1 and not cells[-1]:
            cells.pop()
        if len(cells) != count:
            if number >= len(lines) - 1:  # recorder switched off within a line
                break
            message = f"has {len(cells)} cells, the first line of numbers has {count}"
            raise file_problem(path, message, "complete or remove the line", position=(number, 1))
        rows.append([_parse_number(path, number, c, comma) for c in cells])
    return np.array(rows, dtype=np.float64).reshape(len(rows), count)


def _parse_number(path: Path, line: int, cell: str, comma: bool) -> float:
    if cell.lower() in MISSING_VALUES:
        return float("nan")
    try:
        return float(cell.replace(",", ".") if comma else cell)
    except ValueError:
        raise file_problem(
            path, f"{cell[:40]!r} is not a number", "correct or empty the cell", position=(line, 1)
        ) from None
