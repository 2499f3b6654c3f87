"""Table of numbers: a cursor for rows and one for columns, an order by any column, headings that stay."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.geometry import Region, Size
from textual.message import Message
from textual.scroll_view import ScrollView
from textual.strip import Strip

from railui.desk.widgets.cursor import CURSOR_STYLE, cursor_mark
from railui.desk.widgets.keys import hidden_bindings

GAP = 2  # columns between two columns of the table
LEVELS = (1, 2, 3)  # shades of a cell
PLAIN_MARKS = str.maketrans("‹›", "<>")


@dataclass(frozen=True)
class Column:
    """Column of a table.

    heads: lines above it; short_heads: the same in few characters; cells: texts; values: numbers by which rows are
    ordered, NaN last; marks: a character after each cell, such as › at an upper bound; is_text: the cells are words;
    levels: shade of each cell, from 0, none, to 3.
    """

    heads: tuple[str, ...]
    short_heads: tuple[str, ...]
    cells: tuple[str, ...]
    values: tuple[float, ...]
    marks: str = ""
    is_text: bool = False
    levels: tuple[int, ...] = ()

    def padded(self, text: str, width: int) -> str:
        """Return a head or a cell in a width: words at the left, numbers at the right."""
        return f"{text:<{width}}" if self.is_text else f"{text:>{width}}"

    def width(self, is_short: bool) -> int:
        """Return the width that it needs."""
        return max(len(text) for text in (*(self.short_heads if is_short else self.heads), *self.cells, "")) + 1


class Table(ScrollView, can_focus=True):
    """Rows of numbers under headings; the first column stays at the left."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {
        "table--head",
        "table--text",
        "table--mark",
        "table--column",
        *(f"table--level{k}" for k in LEVELS),
    }
    BINDINGS: ClassVar[list[Any]] = hidden_bindings(
        ("up", "go(-1)", "Row up"),
        ("down", "go(1)", "Row down"),
        ("pageup", "go(-10)", "Ten rows up"),
        ("pagedown", "go(10)", "Ten rows down"),
        ("home", "go(-1000000)", "First row"),
        ("end", "go(1000000)", "Last row"),
        ("left", "column(-1)", "Column left"),
        ("right", "column(1)", "Column right"),
        ("o", "order", "Order by this column"),
        ("less_than_sign", "filter(True)", "At most this value"),
        ("greater_than_sign", "filter(False)", "At least this value"),
        ("u", "unfilter", "All rows"),
        ("y", "copy", "Copy table"),
    )
    HELP = """
**Table**: up and down move through the rows, left and right through the columns; `o` or a click on a heading orders the
rows by that column, again in the other direction. `<` and `>` show only rows whose value in this column is at most, or
at least, that of the row under the cursor; `u` shows all rows again. `y` copies the table.
"""

    @dataclass
    class RowSelected(Message):
        """The cursor has moved to another row; index: number of the row in the order in which the rows were given."""

        table: Table
        index: int

        @property
        def control(self) -> Table:
            """Widget that sent the message."""
            return self.table

    @dataclass
    class ColumnSelected(Message):
        """The cursor has moved to another column; column: its number."""

        table: Table
        column: int

        @property
        def control(self) -> Table:
            """Widget that sent the message."""
            return self.table

    @dataclass
    class Filtered(Message):
        """Other rows are shown."""

        table: Table

    def __init__(self, title: str, placeholder: str = "", *, id: str | None = None) -> None:
        super().__init__(id=id, classes="pane")
        self.border_title = title
        self.placeholder = placeholder
        self.columns: list[Column] = []
        self.order: list[int] = []  # number of the row shown in each line
        self.line = 0  # under the cursor
        self.column = 1  # under the cursor
        self.ordered_by: tuple[int, bool] | None = None  # column, descending
        self.filters: list[tuple[int, bool, float]] = []  # column, whether at most, value
        self.first = 1  # column after the one that stays

    @property
    def row_count(self) -> int:
        """Number of rows."""
        return len(self.columns[0].cells) if self.columns else 0

    @property
    def index(self) -> int:
        """Number of the row under the cursor."""
        return self.order[self.line] if self.line < len(self.order) else 0

    def show(self, columns: Sequence[Column]) -> None:
        """Show columns; the cursor stays on its row if there are as many rows as before."""
        index, is_same_size = self.index, bool(columns) and len(columns[0].cells) == self.row_count
        self.columns = list(columns)
        self.column = min(max(1, self.column), max(1, len(columns) - 1))
        self.first = min(self.first, self.column)
        if self.ordered_by is not None and self.ordered_by[0] >= len(columns):
            self.ordered_by = None
        self.filters = [each for each in self.filters if each[0] < len(columns)]
        self._reorder()
        is_shown = is_same_size and index in self.order
        self.line = self.order.index(index) if is_shown else min(self.line, max(0, len(self.order) - 1))
        self.virtual_size = Size(0, len(self.order) + self.head_count)
        self.refresh()

    def _reorder(self) -> None:
        self.order = [row for row in range(self.row_count) if self._is_shown(row)]
        if self.ordered_by is not None:
            column, descending = self.ordered_by
            values = self.columns[column].values
            missing = [row for row in self.order if math.isnan(values[row])]
            known = [row for row in self.order if not math.isnan(values[row])]
            self.order = sorted(known, key=lambda row: values[row], reverse=descending) + missing

    def _is_shown(self, row: int) -> bool:
        """True if a row fulfils every filter; the value of the filter itself counts."""
        values = ((self.columns[column].values[row], is_at_most, value) for column, is_at_most, value in self.filters)
        return all(v <= value if is_at_most else v >= value for v, is_at_most, value in values)

    # drawing

    @property
    def head_count(self) -> int:
        """Number of lines of the headings."""
        return max((len(self._heads(column)) for column in self.columns), default=0)

    @property
    def is_short(self) -> bool:
        """True if the columns have short headings because the long ones do not fit."""
        width = sum(column.width(False) + GAP for column in self.columns)
        return width > self.scrollable_content_region.width

    def _heads(self, column: Column) -> tuple[str, ...]:
        return column.short_heads if self.is_short else column.heads

    def shown_columns(self) -> list[int]:
        """Return the columns that fit: the first one, and those from `first` on."""
        free, shown = self.scrollable_content_region.width, list[int]()
        for i in (0, *range(self.first, len(self.columns))):
            free -= self.columns[i].width(self.is_short) + GAP
            if free < -GAP and len(shown) > 1:
                break
            shown.append(i)
        return shown

    def render_line(self, y: int) -> Strip:
        width = self.scrollable_content_region.width
        parts = ("head", "text", "mark", "column", *(f"level{k}" for k in LEVELS))
        style = {part: self.get_component_rich_style(f"table--{part}") for part in parts}
        if not self.columns:
            return Strip([Segment(self.placeholder[:width] if y == 0 else "", style["text"])]).adjust_cell_length(
                width, self.rich_style
            )
        line = y - self.head_count + int(self.scroll_offset.y)
        if y < self.head_count:
            segments = self._head_segments(y, style)
        elif line < len(self.order):
            segments = self._row_segments(line, style)
        else:
            return Strip.blank(width, self.rich_style)
        strip = Strip(segments).crop(0, width).adjust_cell_length(width, self.rich_style)
        if y >= self.head_count and line == self.line and self.has_focus:
            return Strip([Segment(strip.text, self.rich_style + CURSOR_STYLE)], width)
        return strip

    def _head_segments(self, y: int, style: dict[str, Style]) -> list[Segment]:
        segments = [Segment("  ", style["head"])]
        for i in self.shown_columns():
            heads, width = self._heads(self.columns[i]), self.columns[i].width(self.is_short)
            text = heads[y] if y < len(heads) else ""
            if y == 0 and self.ordered_by is not None and self.ordered_by[0] == i:
                text = f"{'v' if self.ordered_by[1] else '^'} {text}"[: width - 1]
            is_current = i == self.column and self.has_focus
            text = self.columns[i].padded(text, width - 1)
            segments.append(Segment(f"{text} ", style["column" if is_current else "head"]))
            segments.append(Segment(" " * (GAP - 1), style["head"]))
        return segments

    def _row_segments(self, line: int, style: dict[str, Style]) -> list[Segment]:
        is_plain = bool(getattr(self.app, "is_plain", False))
        segments = [Segment(f"{cursor_mark(is_plain) if line == self.line else ' '} ", style["mark"])]
        row = self.order[line]
        for i in self.shown_columns():
            column = self.columns[i]
            mark = column.marks[row] if column.marks else " "
            cell = column.padded(column.cells[row], column.width(self.is_short) - 1)
            level = column.levels[row] if column.levels else 0
            segments.append(Segment(cell, style[f"level{level}" if level else "text"]))
            segments.append(Segment(mark.translate(PLAIN_MARKS) if is_plain else mark, style["mark"]))
            segments.append(Segment(" " * (GAP - 1), style["text"]))
        return segments

    # keys and mouse

    def action_go(self, by: int) -> None:
        if self.order:
            self._move_to(min(len(self.order) - 1, max(0, self.line + by)))

    def select(self, index: int) -> None:
        """Move the cursor to a row."""
        if index in self.order:
            self._move_to(self.order.index(index))

    def place(self, index: int) -> None:
        """Move the cursor to a row without a message, if it is shown."""
        if index not in self.order:
            return
        self.line = self.order.index(index)
        self._show_cursor()
        self.refresh()

    def show_column(self, column: int) -> None:
        """Move the cursor to a column without a message, and scroll to it."""
        self.column = min(len(self.columns) - 1, max(1, column))
        self.first = min(self.first, self.column)
        self._scroll_to_column()
        self.refresh()

    def _scroll_to_column(self) -> None:
        """Scroll until the column under the cursor is shown."""
        if not self.scrollable_content_region.width:
            return
        while self.first < self.column and self.column not in self.shown_columns():
            self.first += 1

    def _move_to(self, line: int) -> None:
        self.place(self.order[line])
        self.post_message(self.RowSelected(self, self.index))

    def _show_cursor(self) -> None:
        self.scroll_to_region(Region(0, self.line, 1, 1 + self.head_count), animate=False)

    def action_filter(self, is_at_most: bool) -> None:
        if self.order:
            value = self.columns[self.column].values[self.index]
            if value == value:  # a missing value limits nothing
                self._filter([*self.filters, (self.column, is_at_most, value)])

    def action_unfilter(self) -> None:
        self._filter([])

    def _filter(self, filters: list[tuple[int, bool, float]]) -> None:
        index, self.filters = self.index, filters
        self._reorder()
        self.line = self.order.index(index) if index in self.order else 0
        self.virtual_size = Size(0, len(self.order) + self.head_count)
        self._show_cursor()
        self.refresh()
        self.post_message(self.Filtered(self))

    def on_resize(self) -> None:
        self.virtual_size = Size(0, len(self.order) + self.head_count)  # short headings have fewer lines
        self.first = 1
        self._scroll_to_column()
        self.call_after_refresh(self._show_cursor)

    def action_column(self, by: int) -> None:
        self.show_column(self.column + by)
        self.post_message(self.ColumnSelected(self, self.column))

    def action_order(self) -> None:
        if not self.columns:
            return
        index = self.index
        by = self.ordered_by
        self.ordered_by = (self.column, by is not None and by[0] == self.column and not by[1])
        self._reorder()
        self.line = self.order.index(index) if self.order else 0
        self.refresh()

    def on_click(self, event: events.Click) -> None:
        y, x = event.y - self.gutter.top, event.x - self.gutter.left - 2
        for i in self.shown_columns() if self.columns else ():
            width = self.columns[i].width(self.is_short) + GAP - 1
            if 0 <= x < width and i:
                self.column = i
                self.post_message(self.ColumnSelected(self, i))
            x -= width
        line = y - self.head_count + int(self.scroll_offset.y)
        if 0 <= y < self.head_count:
            self.action_order()
        elif 0 <= line < len(self.order):
            self._move_to(line)
            if event.chain == 2:
                self.app.simulate_key("enter")

    def table_text(self, separator: str = "\t") -> str:
        """Return the table with the first lines of its headings, in the order shown."""
        lines = [[" ".join(head for head in column.heads if head) for column in self.columns]]
        lines += [[column.cells[row] for column in self.columns] for row in self.order]
        return "".join(f"{separator.join(line)}\n" for line in lines)

    def action_copy(self) -> None:
        self.app.copy_to_clipboard(self.table_text())
        self.notify("table copied", timeout=2)
