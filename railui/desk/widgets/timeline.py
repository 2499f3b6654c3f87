"""Timeline of a replay: position, gaps and markers in one line; a click or the arrow keys move the position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from rich.text import Text
from textual.events import Click
from textual.message import Message
from textual.widgets import Static

from railui.desk.widgets.keys import hidden_bindings


class Timeline(Static, can_focus=True):
    """Line from the beginning to the end of a recording."""

    BINDINGS: ClassVar[list[Any]] = hidden_bindings(
        ("left", "move(-0.01)", "Back"),
        ("right", "move(0.01)", "Forward"),
        ("home", "move(-1)", "Beginning"),
        ("end", "move(1)", "End"),
    )
    HELP = "\n**Timeline**: left and right move by a hundredth of the recording; a click moves to that place.\n"

    @dataclass
    class Moved(Message):
        """A place was chosen; fraction: 0 .. 1."""

        fraction: float

    def __init__(self, title: str, *, id: str) -> None:
        super().__init__(id=id, classes="pane")
        self.border_title = title
        self.fraction = 0.0
        self.gaps: Sequence[float] = ()
        self.markers: Sequence[float] = ()

    def show(self, fraction: float, gaps: Sequence[float], markers: Sequence[float]) -> None:
        """Show a position, the gaps and the markers, as fractions of the recording."""
        self.fraction, self.gaps, self.markers = fraction, gaps, markers
        self.update(self.line_text(self.content_size.width), layout=False)

    def line_text(self, width: int) -> Text:
        """Return the line in a number of cells."""
        is_plain = bool(getattr(self.app, "is_plain", False))
        rail, knob, gap, marker = ("-", "#", "x", "!") if is_plain else ("─", "█", "×", "▾")
        text = Text(no_wrap=True)
        if width <= 0:
            return text
        here = cell_of(self.fraction, width)
        cells = ["━" if i < here and not is_plain else rail for i in range(width)]
        for signs, places in ((gap, self.gaps), (marker, self.markers), (knob, (self.fraction,))):
            for place in places:
                cells[cell_of(place, width)] = signs
        text.append("".join(cells))
        return text

    def action_move(self, by: float) -> None:
        self.post_message(self.Moved(min(1.0, max(0.0, self.fraction + by))))

    def on_click(self, event: Click) -> None:
        offset = event.get_content_offset(self)
        if offset is not None and self.content_size.width > 1:
            self.post_message(self.Moved(min(1.0, offset.x / (self.content_size.width - 1))))


def cell_of(fraction: float, width: int) -> int:
    """Return the cell of a fraction.

    >>> cell_of(0.0, 10), cell_of(1.0, 10), cell_of(0.5, 11)
    (0, 9, 5)
    """
    return min(width - 1, max(0, round(fraction * (width - 1))))
