"""Plot widget: braille lines, axes with units, limits, cursor, zoom."""

from __future__ import annotations

from functools import cache
from textwrap import wrap
from typing import Any, ClassVar

import numpy as np
from rich.style import Style
from textual import events
from textual.binding import Binding
from textual.strip import Strip
from textual.widget import Widget

from railui.desk.widgets.axis import Scale, scale_of
from railui.desk.widgets.canvas import Canvas
from railui.desk.widgets.keys import hidden_bindings
from railui.desk.widgets.plot_data import ROLES, PlotData, drawn_lines
from railui.desk.widgets.plot_drawing import PlotDrawing

PARTS = ("axis", "grid", "label", "cursor", "band", "band-base")
# of the app, not of each plot: Textual resolves those of a widget anew with every change of its styles
PLOT_CLASSES = frozenset(f"plot--{part}" for part in (*PARTS, *ROLES))


class Plot(Widget, can_focus=True):
    """Plot in character cells with a cursor and zoom along the horizontal axis; its app has PLOT_CLASSES."""

    BINDINGS: ClassVar[list[Any]] = [
        *hidden_bindings(
            ("left", "move(-1)", "Cursor"),
            ("right", "move(1)", "Cursor"),
            ("shift+left", "move(-10)", "Cursor"),
            ("shift+right", "move(10)", "Cursor"),
        ),
        Binding("plus,equals_sign", "zoom(0.5)", "Zoom in", show=False),
        Binding("minus", "zoom(2)", "Zoom out", show=False),
        Binding("0", "all", "Show all", show=False),
        Binding("y", "copy", "Copy value", show=False),
        Binding("Y", "copy_table", "Copy table", show=False),
    ]
    HELP = """
**Plot**: left and right move the cursor (shift: faster); the top line shows the values at the cursor.
`+` and `-` zoom about the cursor, `0` shows all, `y` copies the values at the cursor, `Y` the lines as a table.
The mouse moves the cursor too; its wheel zooms.
"""

    def __init__(
        self,
        data: PlotData,
        title: str = "",
        *,
        id: str | None = None,
        window: tuple[float, float] = (0.0, 1.0),
    ) -> None:
        super().__init__(id=id)
        self.data = data
        self.border_title = title
        self.window = window  # shown part of the horizontal axis
        self.cursor: float | None = None  # position in the window
        self._strips: list[Strip] = []
        self._drawn_state: tuple[Any, ...] = ()

    def show(self, data: PlotData) -> None:
        """Show other data; the window stays."""
        self.data = data
        self.refresh()

    # drawing

    def render_line(self, y: int) -> Strip:
        state = (self.size, self.data, self.window, self.cursor, self.has_focus, self.app.theme, self.visual_style)
        if state != self._drawn_state:
            self._strips = self._draw(self.size.width, self.size.height)
            self._drawn_state = state
        return self._strips[y] if y < len(self._strips) else Strip.blank(self.size.width, self.rich_style)

    def scales(self) -> tuple[Scale, Scale]:
        """Return the scales of both axes in the current window."""
        lines = drawn_lines(self.data)
        x = scale_of(self.data.x, [line.x for line in lines], margin=0.0).zoomed(*self.window)
        inside = [line.y[(line.x >= x.low) & (line.x <= x.high)] for line in lines]
        return x, scale_of(self.data.y, inside, margin=0.06)

    def _draw(self, width: int, height: int) -> list[Strip]:
        canvas = Canvas(width, height, self.rich_style)
        if width < 4 or height < 2:
            return canvas.strips()
        if not self.data.lines and not self.data.bands:
            rows = wrap(self.data.placeholder, width)[:height]
            for i, text in enumerate(rows, (height - len(rows) + 1) // 2):
                canvas.write((width - len(text)) // 2, i, text, self.style("label"))
            return canvas.strips()
        cursor = self.cursor if self.has_focus else None
        text = self.cursor_text() if cursor is not None else ""
        styles = cache(self.style)  # of this drawing: looking one up takes as long as drawing a line
        PlotDrawing(self.data, *self.scales(), styles, self.is_plain, cursor, text).draw(canvas)
        return canvas.strips()

    @property
    def is_plain(self) -> bool:
        """True if only ASCII characters are drawn."""
        return bool(getattr(self.app, "is_plain", False))

    def style(self, role: str) -> Style:
        """Return the style of a part or role: its colour among those of the app on the background of the plot."""
        background = self.background_colors[1]
        colour = background + self.app.get_component_styles(f"plot--{role}").color
        return Style.from_color(colour.rich_color, background.rich_color)

    # values

    def cursor_text(self) -> str:
        """Return the values at the cursor."""
        x = self.scales()[0].value(self.cursor if self.cursor is not None else 0.5)
        parts = [f"{self.data.x.name} {x:.4g} {self.data.x.unit}".rstrip()]
        for line in self.data.lines:
            finite = np.flatnonzero(np.isfinite(line.x) & np.isfinite(line.y))
            if len(finite):
                nearest = finite[int(np.argmin(np.abs(line.x[finite] - x)))]
                parts.append(f"{line.label or line.role} {line.y[nearest]:.4g}")
        unit = f" {self.data.y.unit}" if self.data.y.unit else ""
        return "   ".join(parts) + unit

    def table_text(self) -> str:
        """Return the lines as a tab-separated table, one after the other."""
        p = self.data
        rows = [f"line\t{p.x.label}\t{p.y.label}"]
        for line in drawn_lines(p):
            rows += [f"{line.label or line.role}\t{a:.9g}\t{b:.9g}" for a, b in zip(line.x, line.y, strict=True)]
        return "\n".join(rows) + "\n"

    def action_copy(self) -> None:
        self.app.copy_to_clipboard(self.cursor_text())
        self.notify("values at the cursor copied")

    def action_copy_table(self) -> None:
        self.app.copy_to_clipboard(self.table_text())
        self.notify("lines copied as a table")

    # cursor and window

    def action_move(self, by: int) -> None:
        position = 0.5 if self.cursor is None else self.cursor + by / max(self.size.width, 1)
        self.cursor = min(1.0, max(0.0, position))
        self.refresh()

    def action_zoom(self, factor: float) -> None:
        begin, end = self.window
        centre = begin + (end - begin) * (0.5 if self.cursor is None else self.cursor)
        width = min(1.0, max(1e-3, (end - begin) * factor))
        begin = min(max(0.0, centre - (centre - begin) * width / (end - begin)), 1.0 - width)
        self.window = (begin, begin + width)
        self.refresh()

    def action_all(self) -> None:
        self.window, self.cursor = (0.0, 1.0), None
        self.refresh()

    def on_mouse_move(self, event: events.MouseMove) -> None:
        if self.has_focus:
            self._point(event)

    def on_click(self, event: events.Click) -> None:
        self._point(event)

    def _point(self, event: events.MouseEvent) -> None:
        offset = event.get_content_offset(self)
        if offset is not None and self.size.width:
            self.cursor = min(1.0, offset.x / self.size.width)
            self.refresh()

    def on_mouse_scroll_up(self, event: events.MouseScrollUp) -> None:
        event.stop()
        self.action_zoom(0.8)

    def on_mouse_scroll_down(self, event: events.MouseScrollDown) -> None:
        event.stop()
        self.action_zoom(1.25)
