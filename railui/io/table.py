"""Reading and writing tables of numbers: CSV, plain or gzipped, with comments and a header `name [unit]`."""

from __future__ import annotations

import csv
import gzip
import io
import re
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray
from railui.io.atomic import write_text
from railui.io.problems import NO_POSITION, FileProblems, Findings, Position, refuse_stream, unreadable_file
from railui.io.table_cells import CellFaults, Header, cell_columns, parse_block, split_cells

MAX_ROWS = 20_000_000
MAX_VALUES = 300_000_000  # in memory, 8 bytes each
MAX_BYTES = 2_000_000_000  # uncompressed
MAX_HEADER_BYTES = 1 << 20  # bytes that comments before the header may take
BLOCK_BYTES = 1 << 24  # bytes read at a time
MAX_LINE_BYTES = 1 << 20  # forty thousand columns
COLUMN_HEADER = re.compile(r"\s*(.*?)\s*(?:\[([^\]]*)\])?\s*\Z")
Digits = int | None | Mapping[str, int]
FILE_SIGNATURES = {
    b"\xff\xfe": "UTF-16",
    b"\xfe\xff": "UTF-16",
    b"PK\x03\x04": "a spreadsheet or zip file",
    b"\xd0\xcf\x11\xe0": "a spreadsheet",
}


@dataclass(frozen=True, eq=False)
class Table:
    """Table of a file.

    Attributes
    ----------
    file : str
        Path of the file, or the name of a table made of arrays.
    names : tuple of str
    units : tuple of str or None
    rows : array [row, column]
    comments : tuple of str
        Comment lines without the #.
    header_position : (int, int)
        Line and column of the header; (0, 0) without a file.
    column_positions : tuple of int
        Column of each name in the header line, from 1.
    """

    file: str
    names: tuple[str, ...]
    units: tuple[str | None, ...]
    rows: FloatArray
    comments: tuple[str, ...]
    header_position: Position
    column_positions: tuple[int, ...]

    def column(self, name: str) -> FloatArray:
        """Return a column by name, as a contiguous copy."""
        return np.ascontiguousarray(self.rows[:, self.names.index(name)])

    def cell_position(self, row: int, name: str | None = None) -> Position:
        """Return line and column of a cell; the file is read again. Without a file (0, 0)."""
        if self.header_position == NO_POSITION:
            return NO_POSITION
        return _find_cell(Path(self.file), row, 0 if name is None else self.names.index(name))


def read_header(path: str | Path) -> Header:
    """Read the header of a table; FileProblems as `read_table`."""
    findings = Findings(str(path))
    with _open_table(Path(path), findings) as stream:
        return _read_header(stream, findings, MAX_HEADER_BYTES)[0]


def read_table(path: str | Path, *, drop_unfinished: bool = False) -> Table:
    """Read a table; empty cells become NaN.

    Parameters
    ----------
    path : path
    drop_unfinished : bool
        Leave out a last line without a line end: a recorder lost its power within it.

    Raises
    ------
    FileProblems
        With line and column of every faulty cell.
    """
    findings = Findings(str(path))
    with _open_table(Path(path), findings) as stream:
        header, start = _read_header(stream, findings)
        parts, rows, numbers, line, faults = [], 0, 0, header.line + 1, CellFaults()
        for block in _line_blocks(stream, start, findings, drop_unfinished):
            part = parse_block(block, header, line, faults)
            line += block.count(b"\n")
            rows, numbers = rows + len(part), numbers + part.size
            if rows > MAX_ROWS:
                findings.add("", f"has more than {MAX_ROWS} rows", "cut the recording into parts", position=(line, 1))
                break
            if numbers > MAX_VALUES:
                remedy = "cut the recording into parts, or leave out columns"
                findings.add("", f"has more than {MAX_VALUES} numbers", remedy, position=(line, 1))
                break
            if faults.are_many:
                break
            parts.append(part)
        faults.report(findings)
    findings.raise_errors()
    if rows == 0:
        findings.add("", "has a header and no row", "give one row per sample", position=(header.line, 1))
    findings.raise_errors()
    data = np.concatenate(parts)[:, : len(header.names)]
    return Table(
        str(path), header.names, header.units, data, header.comments, (header.line, 1), header.column_positions
    )


def write_table(
    path: str | Path, columns: Mapping[str, ArrayLike], comments: Sequence[str] = (), digits: Digits = 9
) -> Path:
    """Write a table atomically, gzipped if the name ends in .gz; the keys form the header."""
    return write_text(path, table_text(columns, comments, digits))


def table_text(columns: Mapping[str, ArrayLike], comments: Sequence[str] = (), digits: Digits = 9) -> str:
    """Return a table as text: comments after #, the keys as header, one row per line.

    Parameters
    ----------
    columns, comments
        Values [n] by header, lines before the header.
    digits
        Significant digits of all columns or by header; None for as many as give the same number again.

    Examples
    --------
    >>> table_text({"s [m]": [0.0, 0.1], "yw [m]": [0.0, 1e-3]}, ["synthetic"])
    '# synthetic\\ns [m],yw [m]\\n0,0\\n0.1,0.001\\n'
    >>> table_text({"e1, left [m]": [0.1 + 0.2]}, digits=None)
    '"e1, left [m]"\\n0.30000000000000004\\n'
    """
    arrays = [np.asarray(column, dtype=np.float64) for column in columns.values()]
    rows = np.column_stack(arrays)
    each = [digits[name] if isinstance(digits, Mapping) else digits for name in columns]
    line = ",".join("%r" if d is None else f"%.{d}g" for d in each)
    body = "\n".join([line] * len(rows)) % tuple(rows.ravel().tolist())
    head = [f"# {comment}" for comment in comments] + [_header_line(columns)]
    return "\n".join([*head, body]) + "\n"


def _header_line(names: Iterable[str]) -> str:
    """Return names separated by commas, in quotes where they contain a comma, a quote or a line end."""
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow(names)
    return text.getvalue()


def _open_table(path: Path, findings: Findings) -> IO[bytes]:
    refuse_stream(path)
    try:
        with path.open("rb") as probe:
            start = probe.read(4096)
        description = next((what for mark, what in FILE_SIGNATURES.items() if start.startswith(mark)), None)
        description = description or ("binary" if b"\0" in start and not start.startswith(b"\x1f\x8b") else None)
        if description is None:
            return gzip.open(path, "rb") if start.startswith(b"\x1f\x8b") else path.open("rb")  # type: ignore[return-value]
        findings.add("", f"is {description}, not CSV", "save it as CSV in UTF-8")
    except OSError as error:
        raise unreadable_file(path, error) from None
    raise FileProblems(findings.problems)


def _read(stream: IO[bytes], size: int, findings: Findings) -> bytes:
    try:
        return stream.read(size)
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        findings.add("", f"is damaged or cut off ({error})", "copy it again from where it was recorded")
        raise FileProblems(findings.problems) from None


def _read_header(stream: IO[bytes], findings: Findings, size: int = BLOCK_BYTES) -> tuple[Header, bytes]:
    """Read so many bytes with the header; return it and the bytes after it."""
    data = _read(stream, size, findings).removeprefix(b"\xef\xbb\xbf")
    comments: list[str] = []
    start = 0
    for line, raw in enumerate(data[:MAX_HEADER_BYTES].split(b"\n"), 1):
        start += len(raw) + 1
        text = _decode(raw).rstrip("\r")
        if text.lstrip().startswith("#"):
            comments.append(text.lstrip()[1:].strip())
        elif text.strip():
            return _parse_header(text, line, tuple(comments), findings), data[start:]
    findings.add("", "has no header", "begin with a line such as `t [s],v [m/s],yw [m],e1 [m]`", position=(1, 1))
    raise FileProblems(findings.problems)


def _decode(raw: bytes) -> str:
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _parse_header(text: str, line: int, comments: tuple[str, ...], findings: Findings) -> Header:
    separator = _header_separator(text)
    try:
        cells = [cell.strip() for cell in split_cells(text, separator)]
    except csv.Error as error:
        findings.add("", f"cannot be split into cells: {error}", "close the quotes of each name", position=(line, 1))
        raise FileProblems(findings.problems) from None
    named = cells[:-1] if cells and not cells[-1] and len(cells) > 1 else cells
    matches = [COLUMN_HEADER.match(cell) for cell in named]
    names = tuple(m[1] if m else "" for m in matches)
    units = tuple(m[2].strip() if m and m[2] is not None else None for m in matches)
    places = (cell_columns(text, separator) + (1,) * len(names))[: len(names)]
    for i, name in enumerate(names):
        if not name:
            findings.add("", f"column {i + 1} has no name", "write `name [unit]`", position=(line, places[i]))
        elif name in names[:i]:
            findings.add(name, "occurs twice in the header", "keep one of the columns", position=(line, places[i]))
    findings.raise_errors()
    return Header(names, units, places, line, comments, separator, len(cells))


def _header_separator(text: str) -> str:
    """Return the separator of a header: a semicolon or tab outside quotes, else the comma."""
    outside = re.sub(r'"[^"]*"', "", text)
    return next((s for s in (";", "\t") if s in outside), ",")


def _line_blocks(stream: IO[bytes], start: bytes, findings: Findings, drop_unfinished: bool = False) -> Iterator[bytes]:
    """Yield blocks of complete lines."""
    pending, total = start, len(start)
    while True:
        cut = pending.rfind(b"\n") + 1
        if cut:
            yield pending[:cut]
        more = _read(stream, BLOCK_BYTES, findings)
        total += len(more)
        if total > MAX_BYTES:
            findings.add("", f"is larger than {MAX_BYTES} bytes uncompressed", "cut the recording into parts")
            raise FileProblems(findings.problems)
        pending = pending[cut:]
        if len(pending) > MAX_LINE_BYTES:
            findings.add("", f"has a line of more than {MAX_LINE_BYTES} bytes", "write a line for each sample")
            raise FileProblems(findings.problems)
        if not more:
            if pending.strip() and not drop_unfinished:
                yield pending + b"\n"
            return
        pending += more


def _find_cell(path: Path, row: int, cell: int) -> Position:
    findings = Findings(str(path))
    with _open_table(path, findings) as stream:
        header, start = _read_header(stream, findings)
        line, data_row = header.line, -1
        for block in _line_blocks(stream, start, findings):
            for raw in block.split(b"\n")[:-1]:
                line += 1
                data_row += bool(raw.split(b"#", 1)[0].strip())
                if data_row == row:
                    starts = cell_columns(raw.decode("latin-1"), header.separator)
                    return line, starts[min(cell, len(starts) - 1)]
    return header.line, 1
