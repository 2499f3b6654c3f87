"""Tables on the terminal: construction, cells, width."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import IO, TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

DEFAULT_WIDTH = 160  # columns of a table where the output is not a terminal
MAX_UNBROKEN_LENGTH = 16  # characters of a cell that is never broken

Row = Sequence[Any]


def make_table(
    columns: Sequence[str],
    *sections: Iterable[Row],
    title: str | None = None,
    caption: str | None = None,
    align_right: bool = False,
) -> Table:
    """Return a table of sections of rows, with a rule between sections; every cell as `str`.

    align_right: align all columns but the first to the right.
    """
    from rich.table import Table
    from rich.text import Text

    table = Table(title=title, caption=caption or None)
    for i, name in enumerate(columns):
        table.add_column(name, justify="right" if align_right and i else "left")
    for section in sections:
        table.add_section()
        for row in section:
            table.add_row(*(cell if isinstance(cell, Text) else str(cell) for cell in row))
    return table


def format_cell(value: Any, digits: int = 4, factor: float = 1.0) -> str:
    """Return a value as text: numbers to significant digits, lists with commas, None as a dash.

    factor: what numbers are multiplied by, for the unit of the column.

    >>> format_cell(2.51349), format_cell(None), format_cell("good"), format_cell([1.0, 0.25])
    ('2.513', '-', 'good', '1, 0.25')
    >>> format_cell(0.0071234, 3, 1e3)
    '7.12'
    """
    if isinstance(value, list | tuple):
        return ", ".join(format_cell(item, digits, factor) for item in value)
    if value is None:
        return "-"
    return f"{factor * value:.{digits}g}" if isinstance(value, float) else str(value)


def format_fixed(value: float | None, decimals: int = 3) -> str:
    """Return a number with fixed decimals, None as a dash.

    >>> format_fixed(0.35149), format_fixed(None)
    ('0.351', '-')
    """
    return "-" if value is None else f"{value:.{decimals}f}"


def format_count(number: int, noun: str) -> str:
    """Return a number with its noun, in the plural where needed.

    >>> format_count(1, "case"), format_count(3, "design")
    ('1 case', '3 designs')
    """
    return f"{number} {noun}{'' if number == 1 else 's'}"


def print_table(table: Table, stream: IO[str]) -> None:
    """Print a table and its notes, at the width of the terminal where there is one."""
    from rich.console import Console

    # names come from files: square brackets in them are text, never markup
    width = None if stream.isatty() else DEFAULT_WIDTH
    console = Console(file=stream, width=width, markup=False, emoji=False, highlight=False)
    notes, table.caption = table.caption, None
    console.print(fit_to_width(table, console))
    if notes is not None:  # a caption would be wrapped at the width of the table
        console.print(notes, style="table.caption")


def fit_to_width(table: Table, console: Console) -> Table:
    """Set a table so that it fits the console: without vertical rules where needed, long cells folded.

    No name and no number is truncated.
    """
    from rich import box
    from rich.measure import Measurement

    table.title_justify = "left"
    for column in table.columns:
        column.overflow = "fold"
    natural = Measurement.get(console, console.options.update(max_width=10 * DEFAULT_WIDTH), table).maximum
    if console.width < min(natural, DEFAULT_WIDTH):
        table.box, table.padding, table.pad_edge = box.SIMPLE_HEAD, (0, 0), False
        for column in table.columns:
            head, *cells = (str(cell) for cell in (column.header, *column.cells))
            longest = max(map(len, cells), default=0)
            if longest <= MAX_UNBROKEN_LENGTH:  # numbers and single words are not broken, headings are
                column.width = max(longest, *map(len, head.split()), 1)
    return table
