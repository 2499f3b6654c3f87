"""Layout of delimited text: separator, first line of numbers, names, units, and the kind of each column."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from railui.capture.formats.time_stamps import is_time_stamp
from railui.io.problems import FileProblems, file_problem
from railui.io.units import UnitError, parse_unit

SEPARATORS = (";", "\t", ",", "|")
HEADER_PATTERN = re.compile(r"(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|\s/\s([^\s[\]()]+))?\s*\Z", re.DOTALL)
MISSING_VALUES = frozenset({"", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "nodata"})
MAX_HEADER_LINES = 200
SAMPLE_LINES = 400  # from which the layout is recognised
TYPICAL_RECORDS = 20  # at the end of the sample, which show the kind of each column
MIN_UNIT_SHARE = 0.7  # of the cells of a line of units
OTHER_UNITS = frozenset({"°c", "degc", "°f", "k", "db", "ppm"})  # of channels that are not imported
Kind = Literal["number", "stamp", "text"]


@dataclass(frozen=True)
class Record:
    """Cells of a record, and the number of its last line."""

    line: int
    cells: tuple[str, ...]


@dataclass(frozen=True)
class Layout:
    """Separator, first line of numbers, names, units and kinds of the columns, notes on names that occur twice.

    `is_padded`: the header names all columns but the last, which must be empty (a separator ends each row).
    """

    separator: str
    first_line: int
    names: tuple[str, ...]
    units: tuple[str | None, ...]
    kinds: tuple[Kind, ...]
    is_padded: bool
    notes: tuple[str, ...]


def read_records(path: Path, lines: Iterable[str], separator: str) -> Iterator[Record]:
    """Yield the records of a text; comments and blank lines are skipped, quotes are those of RFC 4180.

    Raises
    ------
    FileProblems
        If a quote is not closed, or text follows a closing quote.
    """
    plain = ("" if line.lstrip().startswith("#") else line for line in lines)
    reader = csv.reader(plain, delimiter=separator, skipinitialspace=separator != "\t", strict=True)
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                yield Record(reader.line_num, tuple(cell.strip() for cell in cells))
    except csv.Error as error:
        message = f"cannot be split into cells: {error}"
        raise file_problem(path, message, "close the quotes of each cell", position=(reader.line_num, 1)) from None


def parse_cell(cell: str) -> float | None:
    """Return the number in a cell, with decimal point or comma; None if it contains none.

    >>> parse_cell("-1,5e3"), parse_cell("#n/a"), parse_cell("1_000")
    (-1500.0, nan, None)
    """
    if cell.lower() in MISSING_VALUES:
        return float("nan")
    try:
        return None if "_" in cell else float(cell.replace(",", ".") if cell.count(",") == 1 else cell)
    except ValueError:
        return None


def find_layout(path: Path, lines: Sequence[str]) -> Layout:
    """Recognise the layout of a text from its first lines; raise FileProblems if it has none."""
    found: list[tuple[tuple[int, int], str, int, list[Record]]] = []
    fault: FileProblems | None = None
    for separator in SEPARATORS:
        try:
            records = list(read_records(path, lines[:SAMPLE_LINES], separator))
        except FileProblems as error:
            fault = fault or error
            continue
        count = _cell_count(records, len(lines) <= SAMPLE_LINES)
        kinds = _column_kinds(records, count, separator)
        useful = sum(kind != "text" for kind in kinds)
        if count >= 2 and useful:
            found.append(((useful - len(kinds), useful), separator, count, records))
    if not found:
        if fault is not None:
            raise fault
        message = f"no line of numbers in the first {MAX_HEADER_LINES} lines"
        raise file_problem(path, message, "export it as CSV", position=(1, 1))
    _, separator, count, records = max(found, key=lambda item: item[0])
    return _read_layout(path, separator, records, count)


def _cell_count(records: Sequence[Record], is_whole: bool) -> int:
    """Return the number of cells of the last records; the very last of a file may be unfinished."""
    counts = [len(record.cells) for record in records[-2:]]
    return 0 if not counts else counts[0] if is_whole else counts[-1]


def _column_kinds(records: Sequence[Record], count: int, separator: str) -> tuple[Kind, ...]:
    """Return the kind of each column in the last records."""
    typical = [record.cells for record in records[-TYPICAL_RECORDS:] if len(record.cells) == count]
    return tuple(column_kind(column, separator) for column in zip(*typical, strict=True))


def column_kind(cells: Sequence[str], separator: str = ",") -> Kind:
    """Return the kind of the majority of the cells that are not missing; a column without any holds numbers.

    A word that contains the separator stands in quotes, and makes the column one of text.

    >>> column_kind(["RUN", "RUN", "1"]), column_kind(["", "1,5"]), column_kind(["12:00:00", ""])
    ('text', 'number', 'stamp')
    >>> column_kind(["0", "1", "2, knee"])
    'text'
    """
    numbers = stamps = words = 0
    for cell in cells:
        if cell.lower() in MISSING_VALUES:
            continue
        if parse_cell(cell) is not None:
            numbers += 1
        elif is_time_stamp(cell):
            stamps += 1
        elif separator in cell and any(letter.isalpha() for letter in cell):
            return "text"
        else:
            words += 1
    if words > numbers + stamps:
        return "text"
    return "stamp" if stamps > numbers else "number"


def _read_layout(path: Path, separator: str, records: Sequence[Record], count: int) -> Layout:
    kinds = _column_kinds(records, count, separator)
    first = next((i for i, record in enumerate(records) if _is_data(record.cells, kinds)), len(records))
    if first == len(records) or records[first].line > MAX_HEADER_LINES:
        message = f"no line of numbers in the first {MAX_HEADER_LINES} lines"
        raise file_problem(path, message, "export it as CSV", position=(1, 1))
    table_rows = [record.cells for record in records[first:] if len(record.cells) == count]
    ends_with_separator = not any(cells[-1] for cells in table_rows)
    header = [record for record in records[:first] if len(record.cells) > 1]
    is_padded = bool(header) and ends_with_separator and len(header[-1].cells) == count - 1
    cells, unit_row = _read_header(path, header, count, is_padded)
    names, units, notes = _names_and_units(cells, unit_row)
    return Layout(separator, records[first].line, names, units, kinds, is_padded, notes)


def _is_data(cells: Sequence[str], kinds: Sequence[Kind]) -> bool:
    """Return True if a record has a number or nothing in the columns of numbers, and one value at least."""
    if len(cells) != len(kinds):
        return False
    pairs = [(cell, kind) for cell, kind in zip(cells, kinds, strict=True) if kind != "text"]
    if not all(parse_cell(cell) is not None or is_time_stamp(cell) for cell, _ in pairs):
        return False
    return any(cell.lower() not in MISSING_VALUES for cell, _ in pairs)


def _read_header(
    path: Path, tables: Sequence[Record], count: int, is_padded: bool
) -> tuple[tuple[str, ...], tuple[str, ...] | None]:
    """Return the record of names above the numbers, and that of units below it, None without one.

    Raises
    ------
    FileProblems
        If the header has another number of cells than the rows.
    """
    if not tables:
        return ("",) * count, None
    header = _fitted(tables[-1], count, is_padded)
    if header is None:
        message = f"has {len(tables[-1].cells)} cells, the rows below have {count}"
        remedy = "give each column one name; quote a name or a number that contains the separator"
        raise file_problem(path, message, remedy, position=(tables[-1].line, 1))
    unit_row: tuple[str, ...] | None = None
    named = _fitted(tables[-2], count, is_padded) if len(tables) > 1 else None
    filled = max(sum(map(bool, header)), sum(map(bool, named or ())))
    is_named = named is not None and sum(map(bool, named)) >= MIN_UNIT_SHARE * filled
    has_names = any("[" in cell.strip()[1:] for cell in header)  # before a unit in brackets
    if named is not None and is_named and not has_names and _are_units(header):
        header, unit_row = named, header
    return header, unit_row


def _fitted(record: Record, count: int, is_padded: bool) -> tuple[str, ...] | None:
    """Return the cells of a header without separators at its end; None if their number is not that of the rows."""
    cells = record.cells
    while len(cells) > count and not cells[-1]:
        cells = cells[:-1]
    cells = (*cells, "") if is_padded and len(cells) == count - 1 else cells
    return cells if len(cells) == count else None


def _names_and_units(
    header: Sequence[str], unit_row: Sequence[str] | None
) -> tuple[tuple[str, ...], tuple[str | None, ...], tuple[str, ...]]:
    """Separate names from units, above a row of units the whole cell is the name; add notes on repeated names."""
    notes: list[str] = []
    names: list[str] = []
    units: list[str | None] = []
    for i, cell in enumerate(header):
        match = HEADER_PATTERN.match(cell) if unit_row is None else None
        name = " ".join((match[1] if match else cell).split()) or f"column_{i + 1}"
        if name in names:
            notes.append(f"{name} occurs several times: column {i + 1} is called {name}_{i + 1}")
            name = f"{name}_{i + 1}"
        names.append(name)
        inside = next((g for g in (match.groups()[1:] if match else ()) if g is not None), None)
        units.append(inside if unit_row is None else unit_row[i].strip("[]()"))
    return tuple(names), tuple(units), tuple(notes)


def _are_units(cells: Sequence[str]) -> bool:
    """Return True if a record consists of units, not of names."""
    unit_count = 0
    for cell in (cell.strip("[]()") for cell in cells):
        try:
            parse_unit(cell or "1")
            unit_count += 1
        except UnitError:
            unit_count += cell.lower() in OTHER_UNITS
    return unit_count >= MIN_UNIT_SHARE * len(cells)
