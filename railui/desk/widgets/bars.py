"""Rows with a name, a horizontal bar and a text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from rich.segment import Segment
from textual import events
from textual.geometry import Region, Size
from textual.message import Message
from textual.scroll_view import ScrollView
from textual.strip import Strip

from railui.desk.widgets.cursor import CURSOR_STYLE, cursor_mark
from railui.desk.widgets.keys import hidden_bindings

BAR_BLOCKS = " ▏▎▍▌▋▊▉█"
OVERFLOW = 1e-6  # of a fraction, beyond which a bar ends in an arrow
MIN_NAME_COLUMNS, MIN_BAR_COLUMNS = 10, 6  # columns that names and bars have where it is narrow


@dataclass(frozen=True)
class Bar:
    """Row: name, bar of a fraction 0 .. 1, text.

    A bar of more than 1 ends in an arrow. reference: fraction of a pale bar behind; mark: position of a line across the
    bar; role: style of the bar.
    """

    name: str
    fraction: float = 0.0
    text: str = ""
    reference: float = 0.0
    mark: float | None = None
    is_emphasised: bool = False
    role: str = "current"


class Bars(ScrollView, can_focus=True):
    """Scrollable rows of bars."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {
        "bars--current",
        "bars--base",
        "bars--mark",
        "bars--text",
        "bars--strong",
    }
    BINDINGS: ClassVar[list[Any]] = hidden_bindings(
        ("up", "go(-1)", "Row up"),
        ("down", "go(1)", "Row down"),
        ("pageup", "go(-10)", "Ten rows up"),
        ("pagedown", "go(10)", "Ten rows down"),
        ("home", "go(-1000000)", "First row"),
        ("end", "go(1000000)", "Last row"),
        ("y", "copy", "Copy table"),
    )
    HELP = "\n**Bars**: up and down move through the rows, `y` copies them as a table.\n"

    @dataclass
    class RowSelected(Message):
        """The cursor has moved to another row."""

        bars: Bars
        index: int

        @property
        def control(self) -> Bars:
            """Widget that sent the message."""
            return self.bars

    def __init__(self, title: str, placeholder: str = "", *, id: str | None = None, has_cursor: bool = False) -> None:
        super().__init__(id=id)
        self.border_title = title
        self.placeholder = placeholder
        self.rows: list[Bar] = []
        self.has_cursor = has_cursor
        self.index = 0
        self.add_class("pane")

    def show(self, rows: Sequence[Bar]) -> None:
        """Show rows; only changed ones are redrawn."""
        old, self.rows = self.rows, list(rows)
        self.index = min(self.index, max(0, len(rows) - 1))
        if len(old) != len(rows) or self._columns(old) != self._columns(self.rows):
            self.virtual_size = Size(0, len(rows))
            self.refresh()
            return
        for i, (a, b) in enumerate(zip(old, self.rows, strict=True)):
            if a != b:
                self.refresh_line(i)

    def _columns(self, rows: Sequence[Bar]) -> tuple[int, int]:
        name, text = (max((len(getattr(row, k)) for row in rows), default=0) for k in ("name", "text"))
        return min(name, max(MIN_NAME_COLUMNS, self.scrollable_content_region.width - text - MIN_BAR_COLUMNS - 3)), text

    def render_line(self, y: int) -> Strip:
        width, index = self.scrollable_content_region.width, y + int(self.scroll_offset.y)
        style = {k: self.get_component_rich_style(f"bars--{k}") for k in ("current", "base", "mark", "text", "strong")}
        if not self.rows and y == 0:
            return Strip([Segment(self.placeholder[:width], style["base"])]).adjust_cell_length(width, self.rich_style)
        if index >= len(self.rows) or width < 4:
            return Strip.blank(width, self.rich_style)
        row = self.rows[index]
        names, texts = self._columns(self.rows)
        rail = width - names - texts - 3
        if rail < 4:
            texts, rail = max(0, width - names - 2), 0
        text = style["strong" if row.is_emphasised else "text"]
        is_current = self.has_cursor and index == self.index
        mark = cursor_mark(bool(getattr(self.app, "is_plain", False))) if is_current else " "
        segments = [Segment(f"{mark}{row.name[:names]:{names}} ", text)]
        segments += self._bar(row, rail, style)
        segments.append(Segment(f" {row.text[:texts]:>{texts}}", text))
        strip = Strip(segments).adjust_cell_length(width, self.rich_style)
        if is_current and self.has_focus:
            return Strip([Segment(strip.text, self.rich_style + CURSOR_STYLE)], width)
        return strip

    def _bar(self, row: Bar, width: int, style: dict[str, Any]) -> list[Segment]:
        if width <= 0:
            return []
        plain = bool(getattr(self.app, "is_plain", False))
        cells: list[tuple[str, Any]] = [(" ", style["text"])] * width
        behind = round(min(1.0, max(0.0, row.reference)) * width)
        for i in range(behind):
            cells[i] = ("." if plain else "░", style["base"])
        eighths = round(min(1.0, max(0.0, row.fraction)) * width * 8)
        for i in range(eighths // 8):
            cells[i] = ("#" if plain else "█", style[row.role])
        if eighths % 8 and eighths // 8 < width and not plain:
            cells[eighths // 8] = (BAR_BLOCKS[eighths % 8], style[row.role])
        if row.mark is not None and 0 <= row.mark <= 1:
            cells[min(width - 1, int(row.mark * width))] = ("|" if plain else "┃", style["mark"])
        if max(row.fraction, row.reference) > 1 + OVERFLOW:
            cells[-1] = (">" if plain else "▶", style["mark"])
        return [Segment(character, cell_style) for character, cell_style in cells]

    def action_go(self, by: int) -> None:
        if not self.rows:
            return
        if not self.has_cursor:
            self.scroll_relative(y=by, animate=False)
            return
        self.select(min(len(self.rows) - 1, max(0, self.index + by)))

    def select(self, index: int) -> None:
        """Move the cursor to a row."""
        self.refresh_line(self.index)
        self.index = index
        self.refresh_line(index)
        self.scroll_to_region(Region(0, index, 1, 1), animate=False)
        self.post_message(self.RowSelected(self, index))

    def on_click(self, event: events.Click) -> None:
        index = event.y - self.gutter.top + int(self.scroll_offset.y)
        if self.has_cursor and 0 <= index < len(self.rows):
            self.select(index)
            if event.chain == 2:
                self.app.simulate_key("enter")

    def action_copy(self) -> None:
        table = "".join(f"{row.name}\t{row.fraction:.6g}\t{row.text}\n" for row in self.rows)
        self.app.copy_to_clipboard(table)
        self.notify("table copied", timeout=2)
