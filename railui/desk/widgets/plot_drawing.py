"""Drawing of a plot into character cells: axes, bands, limits, lines, marks, legend."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from rich.style import Style

from railui.arrays import FloatArray
from railui.desk.widgets.axis import Scale, ticks
from railui.desk.widgets.braille import DOT_COLUMNS, DOT_ROWS, Cells, rasterise_band, rasterise_line, rasterise_points
from railui.desk.widgets.canvas import Canvas, Frame
from railui.desk.widgets.plot_data import Band, LimitLine, PlotData

MAX_LABEL_COLUMNS = 8  # of the labels of the vertical axis
MAX_AXIS_NAME_FRACTION = 0.35  # of the width, for the name of the horizontal axis
MIN_SIZE_WITH_AXES = (18, 6)  # columns, rows
STRIP_ROWS = 3  # of the strip of differences
MIN_ROWS_WITH_STRIP = 8  # of the lines, from which there is room for the strip
MIN_ROWS_OF_LEGEND = 9  # of a plot whose legend has a row of its own


@dataclass(frozen=True)
class PlotDrawing:
    """Drawing of one plot.

    styles: style of a role or part; cursor: position in the window; cursor_text: values there, instead of the legend.
    """

    data: PlotData
    x: Scale
    y: Scale
    styles: Callable[[str], Style]
    is_plain: bool = False
    cursor: float | None = None
    cursor_text: str = ""

    def draw(self, canvas: Canvas) -> None:
        """Draw everything."""
        width, height = canvas.width, canvas.height
        bare = width < MIN_SIZE_WITH_AXES[0] or height < MIN_SIZE_WITH_AXES[1]
        header = [] if bare else self.header(width, height)
        top, bottom = len(header), 0 if bare else 1 + self._label_rows
        rows = height - top - bottom
        marks = [] if bare else [(v, t) for v, t in ticks(self.y, max(2, rows // 2)) if 0 <= self._at(self.y, v) <= 1]
        left = 0 if bare else min(MAX_LABEL_COLUMNS, max((len(t) for _, t in marks), default=0)) + 1
        strip_rows = 0 if bare or rows < MIN_ROWS_WITH_STRIP or not self._has_difference() else STRIP_ROWS + 1
        frame = Frame(left, top, width - left, rows - strip_rows)
        if not bare:
            self._axes(canvas, frame, marks, frame.foot + strip_rows)
        if strip_rows:
            self._strip(canvas, Frame(left, frame.foot + 1, frame.width, strip_rows - 1))
        for band in self.data.bands:
            self._band(canvas, frame, band)
        self._limits(canvas, frame)
        self._lines(canvas, frame)
        self._limit_labels(canvas, frame)
        self._marks(canvas, frame)
        for row, parts in enumerate(header):
            column = 0
            for text, style in parts:
                canvas.write(column, row, text, style)
                column += len(text)
        if self.cursor is not None:
            for row in range(frame.top, frame.foot):
                canvas.put(frame.column(self.cursor), row, self._glyph("│", "|"), self.styles("cursor"), over=False)

    # axes

    def _axes(self, canvas: Canvas, frame: Frame, marks: list[tuple[float, str]], foot: int) -> None:
        axis, label, grid = self.styles("axis"), self.styles("label"), self.styles("grid")
        for row in range(frame.top, foot):
            canvas.put(frame.left - 1, row, self._glyph("│", "|"), axis)
        for value, text in marks:
            row = frame.row(self._at(self.y, value))
            text = text[: frame.left - 1]
            canvas.write(frame.left - 1 - len(text), row, text, label)
            canvas.put(frame.left - 1, row, self._glyph("┤", "+"), axis)
            for column in range(frame.left, frame.right):
                canvas.put(column, row, self._glyph("┈", " "), grid)
        canvas.write(frame.left - 1, foot, self._glyph("└", "+") + self._glyph("─", "-") * frame.width, axis)
        self._horizontal_labels(canvas, frame, foot)

    @property
    def _label_rows(self) -> int:
        """Rows below the horizontal axis: the names of categories stand in two rows alternately."""
        return 2 if self.data.x.categories else 1

    def _horizontal_labels(self, canvas: Canvas, frame: Frame, foot: int) -> None:
        """Write ticks and their texts as far as they do not touch, and the name of the axis at the end of the row."""
        label, rows = self.styles("label"), self._label_rows
        name = self._axis_name(canvas.width)
        free = canvas.width - len(name) - 2 if name else canvas.width + 1
        ends = [0] * rows
        for number, (value, text) in enumerate(self._horizontal_ticks(frame)):
            column, row = frame.column(self._at(self.x, value)), number % rows
            canvas.put(column, foot, self._glyph("┬", "+"), self.styles("axis"))
            at = min(max(0, column - len(text) // 2), canvas.width - len(text))
            if at >= ends[row] and at + len(text) < free:
                canvas.write(at, foot + 1 + row, text, label)
                ends[row] = at + len(text) + 1
        canvas.write(max(0, canvas.width - len(name)), foot + 1, name, label)

    def _horizontal_ticks(self, frame: Frame) -> list[tuple[float, str]]:
        """Return the values with their texts; a category has as many words of its name as fit."""
        names = self.data.x.categories
        if not names:
            return ticks(self.x, max(2, frame.width // 9))
        shown = [k for k in range(len(names)) if 0 <= self._at(self.x, k) <= 1]
        distance = frame.width * (self._at(self.x, 1) - self._at(self.x, 0))
        room = max(1, int(self._label_rows * distance) - 1)
        return [(float(k), textwrap.wrap(names[k], room, break_long_words=False)[0][:room]) for k in shown]

    def _axis_name(self, width: int) -> str:
        """Return the label of the horizontal axis, or its unit if the label is too long."""
        x = self.data.x
        return x.label if len(x.label) <= MAX_AXIS_NAME_FRACTION * width else f"[{x.unit}]" if x.unit else ""

    # contents

    def _has_difference(self) -> bool:
        """Return True if there is a difference with values in the window."""
        difference = self.data.difference
        return difference is not None and bool(np.any(np.isfinite(self._shown_difference())))

    def _shown_difference(self) -> FloatArray:
        """Return the difference, NaN outside the window."""
        difference = self.data.difference
        assert difference is not None
        at = self.x.position(difference.x)
        return np.where((at >= 0) & (at <= 1), difference.y, np.nan)

    def _strip(self, canvas: Canvas, frame: Frame) -> None:
        """Draw the difference around its zero line, and its range in the row above."""
        difference = self.data.difference
        assert difference is not None
        y = self._shown_difference()
        largest = float(np.nanmax(np.abs(y))) or 1.0
        middle = frame.top + frame.height // 2
        for column in range(frame.left, frame.right):
            canvas.put(column, middle, self._glyph("┈", " "), self.styles("grid"))
        canvas.write(frame.left - 2, middle, "0", self.styles("label"))
        px = self.x.position(difference.x) * DOT_COLUMNS * frame.width
        py = (0.5 - 0.48 * y / largest) * DOT_ROWS * frame.height
        cells = rasterise_line(px, py, frame.width, frame.height)
        self._dots(canvas, frame, cells, self.styles("other"))
        canvas.write(frame.left, frame.top - 1, replace(difference, y=y).label[: frame.width], self.styles("label"))

    def _band(self, canvas: Canvas, frame: Frame, band: Band) -> None:
        """Fill the area of a band with dots."""
        columns = DOT_COLUMNS * frame.width
        values = np.array([self.x.value((k + 0.5) / columns) for k in range(columns)])
        low, high = (np.interp(values, band.x, y, np.nan, np.nan) for y in (band.low, band.high))
        size = DOT_ROWS * frame.height
        low, high = ((1 - self.y.position(y)) * size for y in (low, high))
        self._dots(canvas, frame, rasterise_band(low, high, frame.width, frame.height), self.styles(_band_part(band)))

    def _limits(self, canvas: Canvas, frame: Frame) -> None:
        for limit, position in self._shown_limits():
            style = self.styles(limit.role)
            if limit.is_vertical:
                for row in range(frame.top, frame.foot):
                    canvas.put(frame.column(position), row, self._glyph("╎", ":"), style)
            else:
                for column in range(frame.left, frame.right):
                    canvas.put(column, frame.row(position), self._glyph("╌", "-"), style)

    def _limit_labels(self, canvas: Canvas, frame: Frame) -> None:
        """Write the labels of the limits above the lines; those of vertical limits in rows of their own."""
        number = 0
        for limit, position in self._shown_limits():
            style, label = self.styles(limit.role), limit.label
            if not limit.is_vertical:
                canvas.write(canvas.width - len(label) - 1, frame.row(position), label, style)
            elif label:
                column = frame.column(position)
                at = column + 1 if column + len(label) + 1 < canvas.width else column - len(label)
                canvas.write(at, frame.top + number % max(1, frame.height), label, style)
                number += 1

    def _shown_limits(self) -> list[tuple[LimitLine, float]]:
        limits = [(limit, self._at(self.x if limit.is_vertical else self.y, limit.value)) for limit in self.data.limits]
        return [(limit, position) for limit, position in limits if 0 <= position <= 1]

    def _lines(self, canvas: Canvas, frame: Frame) -> None:
        wide, high = DOT_COLUMNS * frame.width, DOT_ROWS * frame.height
        for line in self.data.lines:
            px, py = self.x.position(line.x) * wide, (1 - self.y.position(line.y)) * high
            cells = (rasterise_points if line.is_points else rasterise_line)(px, py, frame.width, frame.height)
            self._dots(canvas, frame, cells, self.styles(line.role))
        if self.is_plain:
            canvas.replace_dots()

    @staticmethod
    def _dots(canvas: Canvas, frame: Frame, cells: Cells, style: Style) -> None:
        for row, column in np.argwhere(cells):
            canvas.dots(frame.left + int(column), frame.top + int(row), int(cells[row, column]), style)

    def _marks(self, canvas: Canvas, frame: Frame) -> None:
        for mark in self.data.marks:
            px, py = self._at(self.x, mark.x), self._at(self.y, mark.y)
            if not (0 <= px <= 1 and 0 <= py <= 1):
                continue
            column, row = frame.column(px), frame.row(py)
            canvas.put(column, row, mark.character, self.styles(mark.role))
            at = column + 2 if column + 2 + len(mark.label) < canvas.width else column - 1 - len(mark.label)
            canvas.write(at, row, mark.label, self.styles(mark.role))

    # header

    def header(self, width: int, height: int) -> list[list[tuple[str, Style]]]:
        """Return the rows above the frame: label of the vertical axis and legend, or the values at the cursor.

        A legend that does not fit after the label takes the place of the name, then a row of its own.
        """
        if self.cursor is not None:
            return [[(self.cursor_text[:width], self.styles("cursor"))]]
        label = self.styles("label")
        name, legend = self._name(width), self._legend()
        size = sum(len(text) for text, _ in legend)
        names = [name, f"[{self.data.y.unit}]" if self.data.y.unit else ""]
        for text in names:
            if len(text) + 1 + size <= width:
                return [[(text.ljust(width - size), label), *legend]]
        if height >= MIN_ROWS_OF_LEGEND:
            return [[(name[:width], label)], legend]
        return [legend]

    def _name(self, width: int) -> str:
        name, x = self.data.y.label, self.data.x
        return name if self._axis_name(width) == x.label else f"{name} over {x.name}"

    def _legend(self) -> list[tuple[str, Style]]:
        """Return the samples and names of what is drawn, each once."""
        drawn = dict.fromkeys((line.label, line.role) for line in self.data.lines if line.label)
        parts: list[tuple[str, Style]] = []
        for band in self.data.bands:
            if band.label:
                parts += [(self._glyph("⣿⣿", "::") + " ", self.styles(_band_part(band)))]
                parts += [(f"{band.label} ", self.styles("label"))]
        for label, role in drawn:
            parts += [(self._glyph("━", "-") * 2 + " ", self.styles(role)), (f"{label} ", self.styles("label"))]
        return parts

    @staticmethod
    def _at(scale: Scale, value: float) -> float:
        return float(scale.position(value))

    def _glyph(self, fine: str, plain: str) -> str:
        return plain if self.is_plain else fine


def _band_part(band: Band) -> str:
    return "band" if band.role == "current" else "band-base"
