"""The form of a design: one line per parameter, with a mark where it was changed, its value and a slider."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.binding import Binding
from textual.geometry import Region, Size
from textual.message import Message
from textual.scroll_view import ScrollView
from textual.strip import Strip

from railui.desk.presenters.written import symbol, value_text
from railui.desk.state.draft import Field

NAME, VALUE, SYMBOL = 22, 14, 9  # columns
STEP = 0.02  # of a range, one press
TYPED = frozenset("0123456789.-")


@dataclass(frozen=True)
class Head:
    """A heading between the lines of a form."""

    text: str


class Form(ScrollView, can_focus=True):
    """Lines of parameters under headings; it posts what is asked for and changes nothing itself."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {
        "form--head", "form--name", "form--value", "form--rail", "form--knob", "form--mark", "form--cursor",
        "form--base",
    }  # fmt: skip
    BINDINGS: ClassVar[list[Any]] = [
        Binding("up", "go(-1)", "Up", show=False),
        Binding("down", "go(1)", "Down", show=False),
        Binding("pageup", "go(-10)", "Page up", show=False),
        Binding("pagedown", "go(10)", "Page down", show=False),
        Binding("home", "go(-1000)", "First", show=False),
        Binding("end", "go(1000)", "Last", show=False),
        Binding("left", "slide(-1)", "Less", show=False),
        Binding("right", "slide(1)", "More", show=False),
        Binding("shift+left", "slide(-5)", "Much less", show=False),
        Binding("shift+right", "slide(5)", "Much more", show=False),
        Binding("enter", "type", "Type", show=False),
        Binding("backspace", "reset", "Back to base", show=False),
        Binding("slash", "search", "Find", show=False),
    ]
    HELP = """
The **form**: every parameter of the design. A dot marks what differs from the file.
Left and right slide a value through the range of real vehicles (shift: faster); a digit or Enter types it,
with or without a unit (`4 MN/m`). Backspace takes the value of the base back, `/` finds a parameter by its name.
Drag the slider with the mouse.
"""

    @dataclass
    class Wanted(Message):
        """A value is wanted at a path; `gesture` joins the steps of one slide."""

        path: str
        value: Any
        gesture: str = ""

    @dataclass
    class Typing(Message):
        """A value is about to be typed, beginning with some letters."""

        field: Field
        begin: str
        more: bool = False  # letters that came before the entry had the keys

    @dataclass
    class Selected(Message):
        """Another line is under the cursor."""

        field: Field

    @dataclass
    class Reset(Message):
        """The value of the base is wanted back."""

        path: str

    class Search(Message):
        """A parameter is looked for by its name."""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.rows: list[Head | Field] = []
        self.base: dict[str, float] = {}
        self.at = 0
        self.gesture = 0
        self.dragging, self.symbols = False, False
        self.typing = False  # has a value been begun whose next letters belong to the entry?

    def fill(self, rows: Sequence[Head | Field], base: dict[str, float]) -> None:
        """The lines anew; the cursor stays on its path."""
        self.symbols = any(isinstance(row, Field) and row.symbol for row in rows)
        path, old = self.field.path if self.field else None, (self.rows, self.base)
        self.rows, self.base = list(rows), base
        lines = [i for i, row in enumerate(self.rows) if isinstance(row, Field)]
        same = next((i for i in lines if self.rows[i].path == path), None)  # type: ignore[union-attr]
        self.at = same if same is not None else min(lines, key=lambda i: abs(i - self.at), default=0)
        if (len(old[0]), old[1]) != (len(self.rows), base):
            self.virtual_size = Size(0, len(self.rows))
            self.refresh()
            return
        for i, row in enumerate(self.rows):  # what did not change is not drawn again
            if row != old[0][i]:
                self.refresh_line(i)

    @property
    def field(self) -> Field | None:
        """The field under the cursor."""
        row = self.rows[self.at] if self.at < len(self.rows) else None
        return row if isinstance(row, Field) else None

    def choose(self, path: str) -> None:
        """Puts the cursor on a path."""
        for i, row in enumerate(self.rows):
            if isinstance(row, Field) and row.path == path:
                self._go(i)
                return

    def _go(self, index: int) -> None:
        for line in {self.at, index}:
            self.refresh_line(line)
        self.at = index
        self.gesture += 1
        self.scroll_to_region(Region(0, max(0, index - 1), 1, 3), animate=False)
        if self.field is not None:
            self.post_message(self.Selected(self.field))

    def on_resize(self) -> None:
        self.scroll_to_region(Region(0, max(0, self.at - 1), 1, 3), animate=False)

    # drawing

    def render_line(self, y: int) -> Strip:
        width, index = self.scrollable_content_region.width, y + int(self.scroll_offset.y)
        if index >= len(self.rows) or width < 4:
            return Strip.blank(width, self.rich_style)
        row = self.rows[index]
        if isinstance(row, Head):
            text = f" {row.text} "
            rule = ("-" if self._plain else "─") * max(0, width - len(text) - 1)
            style = self.get_component_rich_style("form--head")
            return Strip([Segment(f"{text}{rule} "[:width].ljust(width), style)], width)
        segments = self._segments(row, width)
        strip = Strip(segments).adjust_cell_length(width, self.rich_style)
        if index == self.at:
            cursor = self.get_component_rich_style("form--cursor")
            strip = strip.apply_style(Style(bgcolor=cursor.bgcolor, bold=self.has_focus, reverse=self._plain or None))
        return strip

    @property
    def _plain(self) -> bool:
        return bool(getattr(self.app, "plain", False))

    def _segments(self, field: Field, width: int) -> list[Segment]:
        name, value, mark = (self.get_component_rich_style(f"form--{k}") for k in ("name", "value", "mark"))
        dot = ("*" if self._plain else "●") if field.changed else " "
        title = field.name
        found = [Segment(f"{dot} ", mark)]
        if width >= NAME + VALUE + SYMBOL + 12 and self.symbols:
            found.append(Segment(symbol(field.symbol)[: SYMBOL - 1].ljust(SYMBOL), mark if field.changed else name))
            names = min(NAME + 4, NAME + max(0, width - NAME - VALUE - SYMBOL - 18))
        else:
            names = min(NAME, max(8, width - VALUE - 9))
        text = value_text(field)
        if isinstance(field.value, str) and (not field.choices or len(text) > VALUE):
            names = min(names, max(8, len(title) + 2))
            room = max(4, width - sum(len(s.text) for s in found) - names - 1)
            return [*found, Segment(title[: names - 1].ljust(names), name), Segment(text[:room], value)]
        found.append(Segment(title[: names - 1].ljust(names), name))
        found.append(Segment(text[:VALUE].rjust(VALUE), value))
        used = sum(len(s.text) for s in found)
        rail = min(24, width - used - 2)
        if rail >= 5 and isinstance(field.value, float | int) and not field.choices:
            found.append(Segment(" ", name))
            found += self._slider(field, rail)
        elif field.choices and rail >= 5:
            found.append(Segment(("  < >" if self._plain else "  ‹ ›"), name))
        return found

    def _slider(self, field: Field, width: int) -> list[Segment]:
        rail, knob, base = (self.get_component_rich_style(f"form--{k}") for k in ("rail", "knob", "base"))
        assert isinstance(field.value, int | float)
        at = round(field.place(float(field.value)) * (width - 1))
        letters = [("-" if self._plain else "─", rail)] * width
        if field.path in self.base:
            mark = "|" if self._plain else "┼"
            letters[round(field.place(self.base[field.path]) * (width - 1))] = (mark, base)
        letters[at] = ("o" if self._plain else "●", knob)
        return [Segment(letter, style) for letter, style in letters]

    def _rail(self, field: Field) -> tuple[int, int]:
        """Where the slider of a field begins, and how wide it is."""
        segments = self._segments(field, self.scrollable_content_region.width)
        single = [i for i, s in enumerate(segments) if len(s.text) == 1 and i > 3]
        if not single:
            return 0, 0
        sliders = single[1:] if segments[single[0]].text == " " else single
        return sum(len(s.text) for s in segments[: sliders[0]]) if sliders else 0, len(sliders)

    # what is asked for

    def action_go(self, by: int) -> None:
        lines = [i for i, row in enumerate(self.rows) if isinstance(row, Field)]
        if not lines:
            return
        here = lines.index(self.at) if self.at in lines else 0
        self._go(lines[min(len(lines) - 1, max(0, here + by))])

    def action_slide(self, by: int) -> None:
        field = self.field
        if field is None:
            return
        if field.choices:
            here = field.choices.index(field.value) if field.value in field.choices else 0
            value: Any = field.choices[(here + (1 if by > 0 else -1)) % len(field.choices)]
            self.post_message(self.Wanted(field.path, value))
        elif isinstance(field.value, int | float):
            value = field.at(field.place(float(field.value)) + STEP * by)
            self.post_message(self.Wanted(field.path, value, f"{field.path} {self.gesture}"))

    def action_type(self) -> None:
        if self.field is not None:
            self.post_message(self.Typing(self.field, "\n" if self.typing else "", more=self.typing))

    def action_reset(self) -> None:
        if self.field is not None:
            self.post_message(self.Reset(self.field.path))

    def action_search(self) -> None:
        self.post_message(self.Search())

    def on_focus(self) -> None:
        self.typing = False

    def on_key(self, event: events.Key) -> None:
        if self.typing and self.field is not None and event.is_printable:
            event.stop()  # a quick hand: the entry has not the keys yet
            event.prevent_default()
            self.post_message(self.Typing(self.field, event.character or "", more=True))
        elif event.character in TYPED and self.field is not None and not self.field.choices:
            event.stop()
            self.typing = True
            self.post_message(self.Typing(self.field, event.character or ""))

    def on_mouse_down(self, event: events.MouseDown) -> None:
        index = event.y + int(self.scroll_offset.y)
        if index < len(self.rows) and isinstance(self.rows[index], Field):
            self._go(index)
            begin, wide = self._rail(self.rows[index])  # type: ignore[arg-type]
            if wide and begin <= event.x < begin + wide:
                self.dragging = True
                self.capture_mouse()
                self._drag(event)

    def on_mouse_move(self, event: events.MouseMove) -> None:
        if self.dragging:
            self._drag(event)

    def on_mouse_up(self) -> None:
        self.dragging = False
        self.release_mouse()

    def _drag(self, event: events.MouseEvent) -> None:
        field = self.field
        if field is None or not isinstance(field.value, int | float):
            return
        begin, wide = self._rail(field)
        if wide > 1:
            value = field.at((event.x - begin) / (wide - 1))
            self.post_message(self.Wanted(field.path, value, f"{field.path} {self.gesture}"))

    def on_click(self, event: events.Click) -> None:
        if event.chain == 2:
            self.action_type()
