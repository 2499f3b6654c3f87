"""Map of values over two quantities in shades, with a cursor and the present design."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Final

import numpy as np
from rich.style import Style
from textual import events
from textual.message import Message
from textual.strip import Strip
from textual.widget import Widget

from railui.arrays import FloatArray
from railui.desk.widgets.canvas import Canvas, Frame
from railui.desk.widgets.keys import hidden_bindings

SHADES: Final = "·░▒▓█"
PLAIN_SHADES: Final = ".:+%#"
BLANK: Final = "blank: no result"
MAX_LABEL_COLUMNS: Final = 11  # of the values at the left
LABEL_DISTANCE: Final = 10  # columns from one value below to the next


@dataclass(frozen=True, eq=False)
class MapData:
    """Values z [y, x] over the values x and y, NaN where there is none; own: values of the present design."""

    title: str
    unit: str
    x_name: str
    y_name: str
    x: FloatArray
    y: FloatArray
    z: FloatArray
    x_labels: tuple[str, ...] = ()
    y_labels: tuple[str, ...] = ()
    own: tuple[float, float] | None = None
    placeholder: str = ""

    @property
    def levels(self) -> list[float]:
        """Values between the shades, so that each has a like share of the map, in three digits."""
        finite = self.z[np.isfinite(self.z)]
        if not len(finite):
            return []
        shares = np.arange(1, len(SHADES)) / len(SHADES)
        return sorted({float(f"{value:.3g}") for value in np.quantile(finite, shares)})


class HeatMap(Widget, can_focus=True):
    """Map with a cursor on its grid of values."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {
        "map--axis",
        "map--label",
        "map--own",
        "map--cursor",
        *(f"map--level{k}" for k in range(len(SHADES))),
    }
    BINDINGS: ClassVar[list[Any]] = hidden_bindings(
        ("left", "move(-1,0)", "Cursor left"),
        ("right", "move(1,0)", "Cursor right"),
        ("up", "move(0,1)", "Cursor up"),
        ("down", "move(0,-1)", "Cursor down"),
        ("enter", "take", "Take values"),
        ("y", "copy", "Copy table"),
    )
    HELP = """
**Map**: the arrow keys or a click move the cursor, the line above shows its values; Enter sets them in the form. `y`
copies the map as a table.
"""

    @dataclass
    class Taken(Message):
        """The values under the cursor were chosen."""

        x: float
        y: float

    def __init__(self, title: str, *, id: str) -> None:
        super().__init__(id=id, classes="pane")
        self.border_title = title
        self.data: MapData | None = None
        self.at: tuple[int, int] | None = None  # column and row of the grid under the cursor
        self._strips: list[Strip] = []
        self._drawn_state: tuple[Any, ...] = ()

    def show(self, data: MapData) -> None:
        """Show a map."""
        self.data = data
        self.refresh()

    def render_line(self, y: int) -> Strip:
        state = (self.size, self.data, self.at, self.has_focus, self.app.theme, self.visual_style)
        if state != self._drawn_state:
            self._strips = self._draw(self.size.width, self.size.height)
            self._drawn_state = state
        return self._strips[y] if y < len(self._strips) else Strip.blank(self.size.width, self.rich_style)

    @property
    def is_plain(self) -> bool:
        """True if only ASCII characters are drawn."""
        return bool(getattr(self.app, "is_plain", False))

    def _style(self, part: str) -> Style:
        return self.get_component_rich_style(f"map--{part}")

    def _frame(self, data: MapData, width: int, height: int) -> Frame:
        left = min(MAX_LABEL_COLUMNS, max((len(text) for text in data.y_labels), default=0)) + 1
        return Frame(left, 2, max(1, width - left), max(1, height - 4))

    def _draw(self, width: int, height: int) -> list[Strip]:
        canvas, data = Canvas(width, height, self.rich_style), self.data
        if data is None or width < 16 or height < 6 or not np.isfinite(data.z).any():
            text = "" if data is None else data.placeholder
            canvas.write(max(0, (width - len(text)) // 2), height // 2, text, self._style("label"))
            return canvas.strips()
        frame = self._frame(data, width, height)
        levels = data.levels
        canvas.write(0, 0, self.cursor_text(data)[:width], self._style("cursor" if self.at else "label"))
        self._write_legend(canvas, levels)
        shades = PLAIN_SHADES if self.is_plain else SHADES
        z = stretched(data.z, frame.height, frame.width)
        level = np.searchsorted(levels, z, "right")
        styles = [self._style(f"level{k}") for k in range(len(SHADES))]
        for row, column in np.argwhere(np.isfinite(z)):
            k = int(level[row, column])
            canvas.put(frame.left + int(column), frame.foot - 1 - int(row), shades[k], styles[k])
        self._write_axes(canvas, frame, data)
        self._write_marks(canvas, frame, data)
        return canvas.strips()

    def _write_legend(self, canvas: Canvas, levels: list[float]) -> None:
        """Write the shades with the values between them, and what a blank cell is where there is room for it."""
        shades = PLAIN_SHADES if self.is_plain else SHADES
        texts = [*(f" {level:.4g} " for level in levels), ""]
        columns = 2 if 2 * len(texts) + sum(map(len, texts)) <= canvas.width else 1  # of a shade
        column = 0
        for k, text in enumerate(texts):
            canvas.write(column, 1, shades[k] * columns, self._style(f"level{k}"))
            canvas.write(column + columns, 1, text, self._style("label"))
            column += columns + len(text)
        if column + 2 + len(BLANK) <= canvas.width:
            canvas.write(column + 2, 1, BLANK, self._style("label"))

    def _write_axes(self, canvas: Canvas, frame: Frame, data: MapData) -> None:
        label = self._style("label")
        step = max(1, -(-2 * len(data.y) // max(1, frame.height)))
        for i in range(0, len(data.y), step):
            text = data.y_labels[i][:MAX_LABEL_COLUMNS]
            canvas.write(frame.left - 1 - len(text), frame.foot - 1 - cell(i, len(data.y), frame.height), text, label)
        end = 0
        for i in range(len(data.x)):
            at = frame.left + cell(i, len(data.x), frame.width)
            begin = min(max(0, at - len(data.x_labels[i]) // 2), canvas.width - len(data.x_labels[i]))
            if begin >= end:
                canvas.write(begin, frame.foot, data.x_labels[i], label)
                end = begin + max(LABEL_DISTANCE, len(data.x_labels[i]) + 2)
        name = data.x_name
        canvas.write(max(0, canvas.width - len(name)), frame.foot + 1, name, self._style("axis"))
        canvas.write(0, frame.foot + 1, data.y_name[: max(0, canvas.width - len(name) - 2)], self._style("axis"))

    def _write_marks(self, canvas: Canvas, frame: Frame, data: MapData) -> None:
        if data.own is not None:
            places = [index_of(axis, value) for axis, value in zip((data.x, data.y), data.own, strict=True)]
            if all(place is not None for place in places):
                x, y = (float(place) for place in places if place is not None)
                mark = "O" if self.is_plain else "●"
                column = frame.left + cell(x, len(data.x), frame.width)
                canvas.put(column, frame.foot - 1 - cell(y, len(data.y), frame.height), mark, self._style("own"))
        if self.at is not None and self.has_focus:
            column = frame.left + cell(self.at[0], len(data.x), frame.width)
            row = frame.foot - 1 - cell(self.at[1], len(data.y), frame.height)
            canvas.put(column, row, "+" if self.is_plain else "┼", self._style("cursor"))

    def cursor_text(self, data: MapData) -> str:
        """Return name and unit of the map, or the values under the cursor."""
        title = f"{data.title} [{data.unit}]" if data.unit else data.title
        if self.at is None or not self.has_focus:
            return title
        i, j = self.at
        value = data.z[j, i]
        shown = f"{value:.4g} {data.unit}".rstrip() if np.isfinite(value) else "no value"
        return f"{data.x_name} {data.x_labels[i]}, {data.y_name} {data.y_labels[j]}: {shown}"

    def action_move(self, right: int, up: int) -> None:
        if self.data is not None:
            i, j = self.at or (len(self.data.x) // 2, len(self.data.y) // 2)
            self.at = min(len(self.data.x) - 1, max(0, i + right)), min(len(self.data.y) - 1, max(0, j + up))
            self.refresh()

    def on_click(self, event: events.Click) -> None:
        offset = event.get_content_offset(self)
        if offset is None or self.data is None:
            return
        frame = self._frame(self.data, self.size.width, self.size.height)
        x, y = (offset.x - frame.left) / frame.width, (frame.foot - 1 - offset.y) / frame.height
        counts = len(self.data.x), len(self.data.y)
        i, j = (min(n - 1, max(0, round(p * (n - 1)))) for p, n in zip((x, y), counts, strict=True))
        self.at = (i, j)
        self.refresh()
        if event.chain == 2:
            self.action_take()

    def action_take(self) -> None:
        if self.data is not None and self.at is not None:
            self.post_message(self.Taken(float(self.data.x[self.at[0]]), float(self.data.y[self.at[1]])))

    def table_text(self) -> str:
        """Return the map as a tab-separated table: x, y, value."""
        if self.data is None:
            return ""
        data = self.data
        rows = [f"{data.x_name}\t{data.y_name}\t{data.title} [{data.unit}]"]
        for j, y in enumerate(data.y):
            rows += [f"{x:.9g}\t{y:.9g}\t{data.z[j, i]:.9g}" for i, x in enumerate(data.x)]
        return "\n".join(rows) + "\n"

    def action_copy(self) -> None:
        self.app.copy_to_clipboard(self.table_text())
        self.notify("map copied as a table", timeout=2)


def cell(index: float, count: int, size: int) -> int:
    """Return the cell of a place on a grid of `count` values that is stretched over `size` cells.

    >>> cell(0, 5, 9), cell(4, 5, 9), cell(2, 5, 9)
    (0, 8, 4)
    """
    return min(size - 1, max(0, round(index / max(1, count - 1) * (size - 1))))


def index_of(axis: FloatArray, value: float) -> float | None:
    """Return the place of a value between those of an axis, None outside it.

    >>> index_of(np.array([1.0, 2.0, 4.0]), 3.0)
    1.5
    """
    if not axis[0] <= value <= axis[-1]:
        return None
    return float(np.interp(value, axis, np.arange(len(axis))))


def stretched(z: FloatArray, rows: int, columns: int) -> FloatArray:
    """Interpolate values on a grid linearly in a number of cells; NaN next to a missing value.

    >>> stretched(np.array([[0.0, 1.0], [2.0, 3.0]]), 3, 3)[1].tolist()
    [1.0, 1.5, 2.0]
    """
    i, u = _places(z.shape[1], columns)
    j, v = _places(z.shape[0], rows)
    upper, right = np.minimum(j + 1, z.shape[0] - 1), np.minimum(i + 1, z.shape[1] - 1)
    v = v[:, None]
    below = z[j][:, i] * (1 - u) + np.where(u > 0, z[j][:, right], 0.0) * u
    above = z[upper][:, i] * (1 - u) + np.where(u > 0, z[upper][:, right], 0.0) * u
    return np.asarray(below * (1 - v) + np.where(v > 0, above, 0.0) * v)


def _places(count: int, size: int) -> tuple[Any, FloatArray]:
    """Return the value before each cell, and the part of the way to the next one."""
    place = np.linspace(0.0, count - 1.0, size) if size > 1 else np.zeros(1)
    first = np.minimum(place.astype(int), max(0, count - 2))
    return first, place - first
