"""The plot of the desk: lines in braille, axes with units, limits, a cursor that reads values, zoom."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from rich.style import Style
from textual import events
from textual.binding import Binding
from textual.strip import Strip
from textual.widget import Widget

from railui.desk.widgets.axis import Scale, scaled, ticks
from railui.desk.widgets.braille import HIGH, WIDE, drawn, points
from railui.desk.widgets.canvas import Canvas, Frame
from railui.desk.widgets.picture import Picture

GUTTER = 8  # columns that the labels of the vertical axis may take
LONGEST = 0.35  # of the width that the name of the horizontal axis may take
LEAST = (18, 6)  # columns and rows below which only the lines are drawn


class Plot(Widget, can_focus=True):
    """A picture in character cells. Left and right move the cursor, + and - zoom, 0 shows all, y copies a value."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {
        "plot--axis", "plot--grid", "plot--label", "plot--now", "plot--base", "plot--other", "plot--limit",
        "plot--cursor",
    }  # fmt: skip
    BINDINGS: ClassVar[list[Any]] = [
        Binding("left", "move(-1)", "Cursor", show=False),
        Binding("right", "move(1)", "Cursor", show=False),
        Binding("shift+left", "move(-10)", "Cursor", show=False),
        Binding("shift+right", "move(10)", "Cursor", show=False),
        Binding("plus,equals_sign", "zoom(0.5)", "Zoom in"),
        Binding("minus", "zoom(2)", "Zoom out"),
        Binding("0", "all", "Show all", show=False),
        Binding("y", "copy", "Copy value"),
        Binding("Y", "copy_table", "Copy table", show=False),
    ]
    HELP = """
A **plot**. Left and right move the cursor along it (shift: faster); the line above reads the values there.
`+` and `-` zoom around the cursor, `0` shows all, `y` copies the values at the cursor, `Y` the lines as a table.
The mouse moves the cursor too; its wheel zooms.
"""

    def __init__(
        self,
        picture: Picture,
        title: str = "",
        *,
        id: str | None = None,
        window: tuple[float, float] = (0.0, 1.0),
    ) -> None:
        super().__init__(id=id)
        self.picture = picture
        self.border_title = title
        self.window = window  # the part of the horizontal axis that is shown
        self.cursor: float | None = None  # place on the part shown
        self._strips: list[Strip] = []
        self._made: tuple[Any, ...] = ()

    def show(self, picture: Picture) -> None:
        """Another picture in this one's place; the window stays."""
        self.picture = picture
        self.refresh()

    # what is drawn

    def render_line(self, y: int) -> Strip:
        made = (self.size, self.picture, self.window, self.cursor, self.has_focus, self.app.theme, self.visual_style)
        if made != self._made:
            self._strips = self._draw(self.size.width, self.size.height)
            self._made = made
        return self._strips[y] if y < len(self._strips) else Strip.blank(self.size.width, self.rich_style)

    def scales(self) -> tuple[Scale, Scale]:
        """The scales of both axes as they are shown."""
        p = self.picture
        x = scaled(p.x, [line.x for line in p.lines], margin=0.0).part(*self.window)
        inside = [line.y[(line.x >= x.low) & (line.x <= x.high)] for line in p.lines]
        return x, scaled(p.y, inside, margin=0.06)

    def _draw(self, width: int, height: int) -> list[Strip]:
        canvas = Canvas(width, height, self.rich_style)
        if width < 4 or height < 2:
            return canvas.strips()
        if not self.picture.lines:
            canvas.write(max(0, (width - len(self.picture.wait)) // 2), height // 2, self.picture.wait,
                         self._style("label"))  # fmt: skip
            return canvas.strips()
        x, y = self.scales()
        bare = width < LEAST[0] or height < LEAST[1]
        top, bottom = (0, 0) if bare else (1, 2)
        rows = height - top - bottom
        marks = [] if bare else [(v, t) for v, t in ticks(y, max(2, rows // 2)) if 0 <= float(y.place(v)) <= 1]
        left = 0 if bare else min(GUTTER, max((len(t) for _, t in marks), default=0)) + 1
        frame = Frame(left, top, width - left, rows)
        if not bare:
            self._axes(canvas, frame, x, y, marks)
        self._levels(canvas, frame, x, y)
        self._lines(canvas, frame, x, y)
        self._levels(canvas, frame, x, y, named=True)
        self._marks(canvas, frame, x, y)
        if not bare:
            self._head(canvas, x)
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
            row = frame.row(float(y.place(value)))
            text = text[: frame.left - 1]
            canvas.write(frame.left - 1 - len(text), row, text, label)
            canvas.put(frame.left - 1, row, self._glyph("┤", "+"), axis)
            for column in range(frame.left, right):
                canvas.put(column, row, self._glyph("┈", " "), grid)
        canvas.write(frame.left - 1, foot, self._glyph("└", "+") + self._glyph("─", "-") * frame.width, axis)
        name = self._below(canvas.width)
        free = canvas.width - len(name) - 2  # the name of the axis stands at its end
        end = 0
        for value, text in ticks(x, max(2, frame.width // 9)):
            column = frame.left + min(frame.width - 1, int(float(x.place(value)) * frame.width))
            canvas.put(column, foot, self._glyph("┬", "+"), axis)
            at = min(max(0, column - len(text) // 2), canvas.width - len(text))
            if at >= end and at + len(text) < free:
                canvas.write(at, foot + 1, text, label)
                end = at + len(text) + 1
        canvas.write(max(0, canvas.width - len(name)), foot + 1, name, label)

    def _below(self, width: int) -> str:
        """What stands below the picture of the horizontal axis: its name, or its unit where the name is too long."""
        x = self.picture.x
        return x.label if len(x.label) <= LONGEST * width else f"[{x.unit}]" if x.unit else ""

    def _levels(self, canvas: Canvas, frame: Frame, x: Scale, y: Scale, named: bool = False) -> None:
        """Limits below the lines, and their names above them."""
        style = self._style("limit")
        for level in self.picture.levels:
            place = float((x if level.upright else y).place(level.value))
            if not 0 <= place <= 1:
                continue
            if level.upright:
                column = frame.left + min(frame.width - 1, int(place * frame.width))
                for row in range(frame.top, frame.top + frame.height) if not named else ():
                    canvas.put(column, row, self._glyph("╎", ":"), style)
                at = column + 1 if column + len(level.label) + 1 < canvas.width else column - len(level.label)
                canvas.write(at, frame.top, level.label if named else "", style)
                continue
            row = frame.row(place)
            for column in range(frame.left, frame.left + frame.width) if not named else ():
                canvas.put(column, row, self._glyph("╌", "-"), style)
            canvas.write(canvas.width - len(level.label) - 1, row, level.label if named else "", style)

    def _lines(self, canvas: Canvas, frame: Frame, x: Scale, y: Scale) -> None:
        wide, high = WIDE * frame.width, HIGH * frame.height
        for line in self.picture.lines:
            px, py = x.place(line.x) * wide, (1 - y.place(line.y)) * high
            cells = (points if line.points else drawn)(px, py, frame.width, frame.height)
            style = self._style(line.role)
            for row, column in np.argwhere(cells):
                canvas.dots(frame.left + int(column), frame.top + int(row), int(cells[row, column]), style)
        if self.plain:
            canvas.flatten()

    def _marks(self, canvas: Canvas, frame: Frame, x: Scale, y: Scale) -> None:
        for mark in self.picture.marks:
            px, py = float(x.place(mark.x)), float(y.place(mark.y))
            if not (0 <= px <= 1 and 0 <= py <= 1):
                continue
            column, row = frame.left + min(frame.width - 1, int(px * frame.width)), frame.row(py)
            canvas.put(column, row, mark.letter, self._style(mark.role))
            at = column + 2 if column + 2 + len(mark.label) < canvas.width else column - 1 - len(mark.label)
            canvas.write(at, row, mark.label, self._style(mark.role))

    def _head(self, canvas: Canvas, x: Scale) -> None:
        """Above the picture: what the vertical axis is and what the lines are, or the values at the cursor."""
        if self.cursor is not None and self.has_focus:
            canvas.write(0, 0, self.reading()[: canvas.width], self._style("cursor"))
            return
        name = self.picture.y.label
        if self._below(canvas.width) != self.picture.x.label:
            name = f"{name} over {self.picture.x.name}"
        canvas.write(0, 0, name[: canvas.width], self._style("label"))
        told = [(line.label, line.role) for line in self.picture.lines if line.label]
        told = list(dict.fromkeys(told))
        at = canvas.width - sum(len(label) + 4 for label, _ in told) + 1
        if at <= len(name):
            told, at = told[:1], canvas.width - sum(len(label) + 4 for label, _ in told[:1]) + 1
        if at <= len(name):
            return
        for label, role in told:
            canvas.write(at, 0, self._glyph("━", "-") * 2 + " ", self._style(role))
            canvas.write(at + 3, 0, label, self._style("label"))
            at += len(label) + 4

    @property
    def plain(self) -> bool:
        """Letters only?"""
        return bool(getattr(self.app, "plain", False))

    def _glyph(self, fine: str, plain: str) -> str:
        return plain if self.plain else fine

    def _style(self, role: str) -> Style:
        return self.get_component_rich_style(f"plot--{role}")

    # what is read off

    def reading(self) -> str:
        """The values at the cursor."""
        x = self.scales()[0].value(self.cursor if self.cursor is not None else 0.5)
        parts = [f"{self.picture.x.name} {x:.4g} {self.picture.x.unit}".rstrip()]
        for line in self.picture.lines:
            whole = np.flatnonzero(np.isfinite(line.x) & np.isfinite(line.y))
            if len(whole):
                near = whole[int(np.argmin(np.abs(line.x[whole] - x)))]
                parts.append(f"{line.label or line.role} {line.y[near]:.4g}")
        unit = f" {self.picture.y.unit}" if self.picture.y.unit else ""
        return "   ".join(parts) + unit

    def table(self) -> str:
        """The lines as text that a spreadsheet takes, one after the other."""
        p = self.picture
        rows = [f"line\t{p.x.label}\t{p.y.label}"]
        for line in p.lines:
            rows += [f"{line.label or line.role}\t{a:.9g}\t{b:.9g}" for a, b in zip(line.x, line.y, strict=True)]
        return "\n".join(rows) + "\n"

    def action_copy(self) -> None:
        self.app.copy_to_clipboard(self.reading())
        self.notify("copied the values at the cursor")

    def action_copy_table(self) -> None:
        self.app.copy_to_clipboard(self.table())
        self.notify("copied the lines as a table")

    # cursor and window

    def action_move(self, by: int) -> None:
        place = 0.5 if self.cursor is None else self.cursor + by / max(self.size.width, 1)
        self.cursor = min(1.0, max(0.0, place))
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
