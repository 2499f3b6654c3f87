"""Plot widget: braille lines, axes with units, limits, cursor, zoom."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from rich.style import Style
from textual import events
from textual.binding import Binding
from textual.strip import Strip
from textual.widget import Widget

from railui.desk.widgets.axis import Scale, scale_of, ticks
from railui.desk.widgets.braille import DOT_COLUMNS, DOT_ROWS, rasterise_line, rasterise_points
from railui.desk.widgets.canvas import Canvas, Frame
from railui.desk.widgets.keys import hidden_bindings
from railui.desk.widgets.plot_data import PlotData

MAX_LABEL_COLUMNS = 8  # of the labels of the vertical axis
MAX_AXIS_NAME_FRACTION = 0.35  # of the width, for the name of the horizontal axis
MIN_SIZE_WITH_AXES = (18, 6)  # columns, rows


class Plot(Widget, can_focus=True):
    """Plot in character cells with a cursor and zoom along the horizontal axis."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {
        "plot--axis",
        "plot--grid",
        "plot--label",
        "plot--current",
        "plot--base",
        "plot--other",
        "plot--limit",
        "plot--cursor",
    }
    BINDINGS: ClassVar[list[Any]] = [
        *hidden_bindings(
            ("left", "move(-1)", "Cursor"),
            ("right", "move(1)", "Cursor"),
            ("shift+left", "move(-10)", "Cursor"),
            ("shift+right", "move(10)", "Cursor"),
        ),
        Binding("plus,equals_sign", "zoom(0.5)", "Zoom in"),
        Binding("minus", "zoom(2)", "Zoom out"),
        Binding("0", "all", "Show all", show=False),
        Binding("y", "copy", "Copy value"),
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
        p = self.data
        x = scale_of(p.x, [line.x for line in p.lines], margin=0.0).zoomed(*self.window)
        inside = [line.y[(line.x >= x.low) & (line.x <= x.high)] for line in p.lines]
        return x, scale_of(p.y, inside, margin=0.06)

    def _draw(self, width: int, height: int) -> list[Strip]:
        canvas = Canvas(width, height, self.rich_style)
        if width < 4 or height < 2:
            return canvas.strips()
        if not self.data.lines:
            canvas.write(
                max(0, (width - len(self.data.placeholder)) // 2),
                height // 2,
                self.data.placeholder,
                self._style("label"),
            )
            return canvas.strips()
        x, y = self.scales()
        bare = width < MIN_SIZE_WITH_AXES[0] or height < MIN_SIZE_WITH_AXES[1]
        top, bottom = (0, 0) if bare else (1, 2)
        rows = height - top - bottom
        marks = [] if bare else [(v, t) for v, t in ticks(y, max(2, rows // 2)) if 0 <= float(y.position(v)) <= 1]
        left = 0 if bare else min(MAX_LABEL_COLUMNS, max((len(t) for _, t in marks), default=0)) + 1
        frame = Frame(left, top, width - left, rows)
        if not bare:
            self._axes(canvas, frame, x, y, marks)
        self._limits(canvas, frame, x, y)
        self._lines(canvas, frame, x, y)
        self._limits(canvas, frame, x, y, labels=True)
        self._marks(canvas, frame, x, y)
        if not bare:
            self._header(canvas, x)
        if self.cursor is not None and self.has_focus:
            at = frame.left + min(frame.width - 1, int(self.cursor * frame.width))
            for row in range(frame.top, frame.top + frame.height):
                canvas.put(at, row, self._glyph("│", "|"), self._style("cursor"), over=False)
        return canvas.strips()

    def _axes(self, canvas: Canvas, frame: Frame, x: Scale, y: Scale, marks: list[tuple[float, str]]) -> None:
        axis, label, grid = self._style("axis"), self._style("label"), self._style("grid")
        right, foot = frame.left + frame.width, frame.top + frame.height
        for row in range(frame.top, foot):
            canvas.put(frame.left - 1, row, self._glyph("│", "|"), axis)
        for value, text in marks:
            row = frame.row(float(y.position(value)))
            text = text[: frame.left - 1]
            canvas.write(frame.left - 1 - len(text), row, text, label)
            canvas.put(frame.left - 1, row, self._glyph("┤", "+"), axis)
            for column in range(frame.left, right):
                canvas.put(column, row, self._glyph("┈", " "), grid)
        canvas.write(frame.left - 1, foot, self._glyph("└", "+") + self._glyph("─", "-") * frame.width, axis)
        name = self._axis_name(canvas.width)
        free = canvas.width - len(name) - 2  # the name of the axis is at its end
        end = 0
        for value, text in ticks(x, max(2, frame.width // 9)):
            column = frame.left + min(frame.width - 1, int(float(x.position(value)) * frame.width))
            canvas.put(column, foot, self._glyph("┬", "+"), axis)
            at = min(max(0, column - len(text) // 2), canvas.width - len(text))
            if at >= end and at + len(text) < free:
                canvas.write(at, foot + 1, text, label)
                end = at + len(text) + 1
        canvas.write(max(0, canvas.width - len(name)), foot + 1, name, label)

    def _axis_name(self, width: int) -> str:
        """Return the label of the horizontal axis, or its unit if the label is too long."""
        x = self.data.x
        return x.label if len(x.label) <= MAX_AXIS_NAME_FRACTION * width else f"[{x.unit}]" if x.unit else ""

    def _limits(self, canvas: Canvas, frame: Frame, x: Scale, y: Scale, labels: bool = False) -> None:
        """Draw the limits (below the lines), or their labels (above the lines)."""
        style = self._style("limit")
        for limit in self.data.limits:
            position = float((x if limit.is_vertical else y).position(limit.value))
            if not 0 <= position <= 1:
                continue
            if limit.is_vertical:
                column = frame.left + min(frame.width - 1, int(position * frame.width))
                for row in range(frame.top, frame.top + frame.height) if not labels else ():
                    canvas.put(column, row, self._glyph("╎", ":"), style)
                at = column + 1 if column + len(limit.label) + 1 < canvas.width else column - len(limit.label)
                canvas.write(at, frame.top, limit.label if labels else "", style)
                continue
            row = frame.row(position)
            for column in range(frame.left, frame.left + frame.width) if not labels else ():
                canvas.put(column, row, self._glyph("╌", "-"), style)
            canvas.write(canvas.width - len(limit.label) - 1, row, limit.label if labels else "", style)

    def _lines(self, canvas: Canvas, frame: Frame, x: Scale, y: Scale) -> None:
        wide, high = DOT_COLUMNS * frame.width, DOT_ROWS * frame.height
        for line in self.data.lines:
            px, py = x.position(line.x) * wide, (1 - y.position(line.y)) * high
            cells = (rasterise_points if line.is_points else rasterise_line)(px, py, frame.width, frame.height)
            style = self._style(line.role)
            for row, column in np.argwhere(cells):
                canvas.dots(frame.left + int(column), frame.top + int(row), int(cells[row, column]), style)
        if self.is_plain:
            canvas.replace_dots()

    def _marks(self, canvas: Canvas, frame: Frame, x: Scale, y: Scale) -> None:
        for mark in self.data.marks:
            px, py = float(x.position(mark.x)), float(y.position(mark.y))
            if not (0 <= px <= 1 and 0 <= py <= 1):
                continue
            column, row = frame.left + min(frame.width - 1, int(px * frame.width)), frame.row(py)
            canvas.put(column, row, mark.character, self._style(mark.role))
            at = column + 2 if column + 2 + len(mark.label) < canvas.width else column - 1 - len(mark.label)
            canvas.write(at, row, mark.label, self._style(mark.role))

    def _header(self, canvas: Canvas, x: Scale) -> None:
        """Draw the label of the vertical axis and the legend, or the values at the cursor."""
        if self.cursor is not None and self.has_focus:
            canvas.write(0, 0, self.cursor_text()[: canvas.width], self._style("cursor"))
            return
        name = self.data.y.label
        if self._axis_name(canvas.width) != self.data.x.label:
            name = f"{name} over {self.data.x.name}"
        canvas.write(0, 0, name[: canvas.width], self._style("label"))
        legend = [(line.label, line.role) for line in self.data.lines if line.label]
        legend = list(dict.fromkeys(legend))
        at = canvas.width - sum(len(label) + 4 for label, _ in legend) + 1
        if at <= len(name):
            legend = legend[:1]
            at = canvas.width - sum(len(label) + 4 for label, _ in legend) + 1
        if at <= len(name):
            return
        for label, role in legend:
            canvas.write(at, 0, self._glyph("━", "-") * 2 + " ", self._style(role))
            canvas.write(at + 3, 0, label, self._style("label"))
            at += len(label) + 4

    @property
    def is_plain(self) -> bool:
        """True if only ASCII characters are drawn."""
        return bool(getattr(self.app, "is_plain", False))

    def _glyph(self, fine: str, plain: str) -> str:
        return plain if self.is_plain else fine

    def _style(self, role: str) -> Style:
        return self.get_component_rich_style(f"plot--{role}")

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
        for line in p.lines:
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
