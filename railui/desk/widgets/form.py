"""Form widget: a row per parameter with a mark for changes, its value and a slider."""

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

from railui.desk.state.form_rows import Field, Heading, symbol_text, value_text
from railui.desk.widgets.cursor import CURSOR_STYLE, cursor_mark
from railui.desk.widgets.keys import hidden_bindings

NAME_COLUMNS, VALUE_COLUMNS, SYMBOL_COLUMNS = 22, 14, 9  # columns
NUMBER_CHARACTERS = frozenset("0123456789.-")


class Form(ScrollView, can_focus=True):
    """Rows of parameters under headings; posts messages with the requested changes."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {
        "form--head",
        "form--name",
        "form--value",
        "form--rail",
        "form--knob",
        "form--mark",
        "form--base",
    }
    BINDINGS: ClassVar[list[Any]] = hidden_bindings(
        ("up", "go(-1)", "Up"),
        ("down", "go(1)", "Down"),
        ("pageup", "go(-10)", "Page up"),
        ("pagedown", "go(10)", "Page down"),
        ("home", "go(-1000)", "First"),
        ("end", "go(1000)", "Last"),
        ("left", "slide(-1)", "Less"),
        ("right", "slide(1)", "More"),
        ("shift+left", "slide(-5)", "Much less"),
        ("shift+right", "slide(5)", "Much more"),
        ("enter", "type", "Type"),
        ("backspace", "reset", "Back to base"),
        ("slash", "search", "Find"),
    )
    HELP = """
**Form**: every parameter of the design. A dot marks values that differ from the file, `!` values outside the range of
real vehicles. Left and right move the slider (shift: faster); a digit or Enter starts typing a value: in the unit that
is shown, or with another one (`4 MN/m`). Backspace restores the value of the base, `/` searches for a parameter. The
mouse drags the slider.
"""

    @dataclass
    class ValueRequested(Message):
        """Request to set a value; `gesture` identifies one slider movement."""

        path: str
        value: Any
        gesture: str = ""

    @dataclass
    class StepRequested(Message):
        """Request to move a slider by steps from its value then, or to take another choice."""

        path: str
        by: int
        gesture: str = ""

    @dataclass
    class EntryRequested(Message):
        """Request to type a value, beginning with `text`."""

        field: Field
        text: str
        is_continued: bool = False  # typed before the input had the focus

    @dataclass
    class FieldSelected(Message):
        """The cursor has moved to another field."""

        field: Field

    @dataclass
    class ResetRequested(Message):
        """Request to restore the value of the base."""

        path: str

    class SearchRequested(Message):
        """Request to search for a parameter by name."""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.rows: list[Heading | Field] = []
        self.base: dict[str, float] = {}
        self.index = 0
        self.gesture = 0
        self.is_dragging = False
        self.has_symbols = False
        self.is_typing = False  # further characters belong to the input

    def fill(self, rows: Sequence[Heading | Field], base: dict[str, float]) -> None:
        """Show rows; the cursor stays on its path."""
        self.has_symbols = any(isinstance(row, Field) and row.symbol for row in rows)
        path = self.field.path if self.field else None
        old_rows, old_base = self.rows, self.base
        self.rows = list(rows)
        self.base = base
        lines = [i for i, row in enumerate(self.rows) if isinstance(row, Field)]
        same = next((i for i in lines if self.rows[i].path == path), None)  # type: ignore[union-attr]
        self.index = same if same is not None else min(lines, key=lambda i: abs(i - self.index), default=0)
        if (len(old_rows), old_base) != (len(self.rows), base):
            self.virtual_size = Size(0, len(self.rows))
            self.refresh()
            return
        for i, row in enumerate(self.rows):
            if row != old_rows[i]:  # only changed rows are redrawn
                self.refresh_line(i)

    @property
    def field(self) -> Field | None:
        """Field under the cursor."""
        row = self.rows[self.index] if self.index < len(self.rows) else None
        return row if isinstance(row, Field) else None

    def select(self, path: str) -> None:
        """Move the cursor to a path."""
        for i, row in enumerate(self.rows):
            if isinstance(row, Field) and row.path == path:
                self._move_to(i)
                return

    def _move_to(self, index: int) -> None:
        for line in {self.index, index}:
            self.refresh_line(line)
        self.index = index
        self.gesture += 1
        self.scroll_to_region(Region(0, max(0, index - 1), 1, 3), animate=False)
        if self.field is not None:
            self.post_message(self.FieldSelected(self.field))

    def on_resize(self) -> None:
        self.scroll_to_region(Region(0, max(0, self.index - 1), 1, 3), animate=False)

    # drawing

    def render_line(self, y: int) -> Strip:
        width, index = self.scrollable_content_region.width, y + int(self.scroll_offset.y)
        if index >= len(self.rows) or width < 4:
            return Strip.blank(width, self.rich_style)
        row = self.rows[index]
        if isinstance(row, Heading):
            text = f" {row.text} "
            rule = ("-" if self._is_plain else "─") * max(0, width - len(text) - 1)
            style = self.get_component_rich_style("form--head")
            return Strip([Segment(f"{text}{rule} "[:width].ljust(width), style)], width)
        segments = self._segments(row, width)
        strip = Strip(segments).adjust_cell_length(width, self.rich_style)
        if index == self.index and self.has_focus:
            return Strip([Segment(strip.text, self.rich_style + CURSOR_STYLE)], width)
        return strip

    @property
    def _is_plain(self) -> bool:
        return bool(getattr(self.app, "is_plain", False))

    def _segments(self, field: Field, width: int) -> list[Segment]:
        name, value, mark = (self.get_component_rich_style(f"form--{k}") for k in ("name", "value", "mark"))
        dot = ("*" if self._is_plain else "●") if field.is_changed else " "
        is_current = self.rows[self.index] is field
        segments = [Segment(f"{dot}{cursor_mark(self._is_plain) if is_current else ' '}", mark)]
        if width >= NAME_COLUMNS + VALUE_COLUMNS + SYMBOL_COLUMNS + 12 and self.has_symbols:
            segments.append(
                Segment(
                    symbol_text(field.symbol)[: SYMBOL_COLUMNS - 1].ljust(SYMBOL_COLUMNS),
                    mark if field.is_changed else name,
                )
            )
            names = min(
                NAME_COLUMNS + 4, NAME_COLUMNS + max(0, width - NAME_COLUMNS - VALUE_COLUMNS - SYMBOL_COLUMNS - 18)
            )
        else:
            names = min(NAME_COLUMNS, max(8, width - VALUE_COLUMNS - 9))
        text = value_text(field)
        if isinstance(field.value, str) and (not field.choices or len(text) > VALUE_COLUMNS):
            names = min(names, max(8, len(field.name) + 2))
            room = max(4, width - sum(len(s.text) for s in segments) - names - 1)
            return [*segments, Segment(field.name[: names - 1].ljust(names), name), Segment(text[:room], value)]
        text = (f"! {text}" if field.is_unusual else text)[:VALUE_COLUMNS]
        style = mark if field.is_unusual else value
        shown = f"{field.name[: names + VALUE_COLUMNS - len(text) - 1]} "  # a long name takes blanks before the value
        segments.append(Segment(shown.ljust(names), name))
        segments.append(Segment(text.rjust(names + VALUE_COLUMNS - max(names, len(shown))), style))
        used = sum(len(s.text) for s in segments)
        rail = min(24, width - used - 2)
        if rail >= 5 and isinstance(field.value, float | int) and not field.choices:
            segments.append(Segment(" ", name))
            segments += self._slider(field, rail)
        elif field.choices and rail >= 5:
            segments.append(Segment(("  < >" if self._is_plain else "  ‹ ›"), name))
        return segments

    def _slider(self, field: Field, width: int) -> list[Segment]:
        rail, knob, base = (self.get_component_rich_style(f"form--{k}") for k in ("rail", "knob", "base"))
        assert isinstance(field.value, int | float)
        position = round(field.position(float(field.value)) * (width - 1))
        cells = [("-" if self._is_plain else "─", rail)] * width
        if field.path in self.base:
            mark = "|" if self._is_plain else "┼"
            cells[round(field.position(self.base[field.path]) * (width - 1))] = (mark, base)
        cells[position] = ("o" if self._is_plain else "●", knob)
        return [Segment(character, style) for character, style in cells]

    def slider_position(self, field: Field) -> tuple[int, int]:
        """Return the first column of the slider of a field and its width."""
        segments = self._segments(field, self.scrollable_content_region.width)
        single = [i for i, s in enumerate(segments) if len(s.text) == 1 and i > 3]
        if not single:
            return 0, 0
        sliders = single[1:] if segments[single[0]].text == " " else single
        return sum(len(s.text) for s in segments[: sliders[0]]) if sliders else 0, len(sliders)

    # keys and mouse

    def action_go(self, by: int) -> None:
        lines = [i for i, row in enumerate(self.rows) if isinstance(row, Field)]
        if not lines:
            return
        position = (lines.index(self.index) if self.index in lines else 0) + by
        self._move_to(lines[min(len(lines) - 1, max(0, position))])

    def action_slide(self, by: int) -> None:
        if self.field is not None:
            self.post_message(self.StepRequested(self.field.path, by, f"{self.field.path} {self.gesture}"))

    def action_type(self) -> None:
        if self.field is not None:
            self.post_message(
                self.EntryRequested(self.field, "\n" if self.is_typing else "", is_continued=self.is_typing)
            )

    def action_reset(self) -> None:
        if self.field is not None:
            self.post_message(self.ResetRequested(self.field.path))

    def action_search(self) -> None:
        self.post_message(self.SearchRequested())

    def on_focus(self) -> None:
        self.is_typing = False

    def on_key(self, event: events.Key) -> None:
        if self.is_typing and self.field is not None and event.is_printable:
            event.stop()  # the input does not have the focus yet
            event.prevent_default()
            self.post_message(self.EntryRequested(self.field, event.character or "", is_continued=True))
        elif event.character in NUMBER_CHARACTERS and self.field is not None and not self.field.choices:
            event.stop()
            self.is_typing = True
            self.post_message(self.EntryRequested(self.field, event.character or ""))

    def on_mouse_down(self, event: events.MouseDown) -> None:
        index = event.y + int(self.scroll_offset.y)
        if index < len(self.rows) and isinstance(self.rows[index], Field):
            self._move_to(index)
            begin, wide = self.slider_position(self.rows[index])  # type: ignore[arg-type]
            if wide and begin <= event.x < begin + wide:
                self.is_dragging = True
                self.capture_mouse()
                self._drag(event)

    def on_mouse_move(self, event: events.MouseMove) -> None:
        if self.is_dragging:
            self._drag(event)

    def on_mouse_up(self) -> None:
        self.is_dragging = False
        self.release_mouse()

    def _drag(self, event: events.MouseEvent) -> None:
        field = self.field
        if field is None or not isinstance(field.value, int | float):
            return
        begin, wide = self.slider_position(field)
        if wide > 1:
            value = field.value_at((event.x - begin) / (wide - 1))
            self.post_message(self.ValueRequested(field.path, value, f"{field.path} {self.gesture}"))

    def on_click(self, event: events.Click) -> None:
        if self.field is not None and self.field.choices:
            line = "".join(segment.text for segment in self._segments(self.field, self.scrollable_content_region.width))
            arrow = line[event.x : event.x + 1]
            if arrow in ("‹", "›", "<", ">"):
                self.action_slide(1 if arrow in "›>" else -1)
        elif event.chain == 2:
            self.action_type()
