"""Delimited text of instruments: any encoding, separator, decimal sign and line end, units in the header."""

from __future__ import annotations

import gzip
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.capture.formats.delimited_layout import (
    MISSING_VALUES,
    Layout,
    Record,
    column_kind,
    find_layout,
    parse_cell,
    read_records,
)
from railui.capture.formats.time_base import recording_from_columns
from railui.capture.formats.time_stamps import StampError, is_time_stamp, parse_time_stamps
from railui.capture.processing.recording import Recording
from railui.io.problems import file_problem
from railui.io.table import MAX_BYTES, write_table

THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")  # such a cell may be 1.234 or 1234


def read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    """Read one recording; raise FileProblems with the line of a cell that is not a number."""
    text = _decode(_read_bytes(path))
    lines = text.split("\n")
    layout = find_layout(path, lines)
    records, notes = _data_records(path, lines, layout)
    columns: dict[str, FloatArray] = {}
    units = dict(zip(layout.names, layout.units, strict=True))
    stamped = []
    texts = list(zip(*(record.cells for record in records), strict=True))
    kinds = [column_kind(cells, layout.separator) for cells in texts]
    notes.extend(layout.notes)
    has_comma = _check_decimal_signs(path, records, texts, kinds, layout.separator)
    for i, name in enumerate(layout.names):
        if kinds[i] == "text":
            word = next(cell for cell in texts[i] if parse_cell(cell) is None and not is_time_stamp(cell))
            notes.append(f"{name} holds text, such as {word[:40]!r}: skipped")
        elif kinds[i] == "stamp":
            columns[name], units[name] = _stamps(path, name, texts[i], records), "s"
            stamped.append(name)
        elif name == f"column_{i + 1}" and all(cell.lower() in MISSING_VALUES for cell in texts[i]):
            continue  # after a separator at the end of each row
        elif layout.is_padded and i == len(layout.names) - 1:
            line = next(record.line for record in records if record.cells[-1])
            message = f"has {len(layout.names)} cells, the header names {len(layout.names) - 1}"
            raise file_problem(path, message, "give each column one name", position=(line, 1))
        else:
            columns[name] = _numbers(path, name, texts[i], records, has_comma)
    clock = clock if clock is not None or len(stamped) != 1 else _stamped_clock(stamped[0], columns)
    line_numbers = [record.line for record in records]
    recording = recording_from_columns(path, columns, units, clock, rate, line_numbers)
    recording.notes.extend(notes)
    return [recording]


def _stamped_clock(stamped: str, columns: dict[str, FloatArray]) -> str | None:
    """Return the column of time stamps as the clock, unless a column of numbers is called t or time."""
    return None if {"t", "time"} & {name.lower() for name in columns if name != stamped} else stamped


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


def _data_records(path: Path, lines: Sequence[str], layout: Layout) -> tuple[list[Record], list[str]]:
    """Return the records of numbers, and notes; raise FileProblems for one with another number of cells."""
    records: list[Record] = []
    notes: list[str] = []
    count = len(layout.names)
    odd: Record | None = None
    for record in read_records(path, lines, layout.separator):
        if record.line < layout.first_line:
            continue
        if odd is not None:
            break
        cells = record.cells
        if len(cells) == count + 1 and not cells[-1]:
            cells = cells[:-1]
        if len(cells) == count:
            records.append(Record(record.line, cells))
        else:
            odd = record
    if odd is not None:
        if odd.line < len(lines):  # only the last line may be unfinished: recorder switched off
            message = f"has {len(odd.cells)} cells, the first line of numbers has {count}"
            raise file_problem(path, message, "complete or remove the line", position=(odd.line, 1))
        notes.append(f"line {odd.line}, the last one, is unfinished: left out")
    return records, notes


def _check_decimal_signs(
    path: Path, records: Sequence[Record], texts: Sequence[Sequence[str]], kinds: Sequence[str], separator: str
) -> bool:
    """Return True if decimals have a comma; raise FileProblems if point and comma occur, or commas may be thousands."""
    comma: tuple[int, str] | None = None
    point: tuple[int, str] | None = None
    is_open = True
    for cells, kind in zip(texts, kinds, strict=True):
        if kind != "number":
            continue
        for i, cell in enumerate(cells):
            if "," in cell:
                comma = comma or (i, cell)
                is_open = is_open and THOUSANDS.fullmatch(cell) is not None
            elif "." in cell:
                point = point or (i, cell)
    if comma is None:
        return False
    if point is not None:
        line = records[max(comma[0], point[0])].line
        message = f"has numbers with a comma, {comma[1]!r}, and with a point, {point[1]!r}"
        raise file_problem(path, message, "export with one decimal sign, without thousands", position=(line, 1))
    if is_open and separator == ",":
        message = f"{comma[1]!r} may have a decimal comma or a comma between thousands"
        remedy = "export without thousands separators, decimals with a point"
        raise file_problem(path, message, remedy, position=(records[comma[0]].line, 1))
    return True


def _numbers(path: Path, name: str, cells: Sequence[str], records: Sequence[Record], has_comma: bool) -> FloatArray:
    try:
        if not has_comma:
            values = np.array(list(map(float, cells)), dtype=np.float64)
            if not any("_" in cell for cell in cells):
                return values
    except ValueError:
        pass
    parsed = [parse_cell(cell) for cell in cells]
    fault = next((i for i, value in enumerate(parsed) if value is None), None)
    if fault is not None:
        what = "a time stamp" if is_time_stamp(cells[fault]) else "not a number"
        message = f"{cells[fault][:40]!r} is {what}"
        raise file_problem(path, message, "correct or empty the cell", name, position=(records[fault].line, 1))
    return np.array(parsed, dtype=np.float64)


def _stamps(path: Path, name: str, cells: Sequence[str], records: Sequence[Record]) -> FloatArray:
    try:
        return parse_time_stamps(cells, MISSING_VALUES)
    except StampError as error:
        line = records[error.index].line
        raise file_problem(path, error.message, error.remedy, name, position=(line, 1)) from None


def write(path: Path, recording: Recording) -> None:
    """Write the time or distance and all channels, with as many digits as give the same numbers again."""
    columns = recording.columns()
    units = {name: recording.unit(name) for name in columns}
    headers = {name: name if unit is None else f"{name} [{unit}]" for name, unit in units.items()}
    if len(set(headers.values())) < len(columns):
        raise ValueError("two channels have the same name: rename one")
    write_table(path, {headers[name]: x for name, x in columns.items()}, digits=None)
