"""Plot of a front over any two of its quantities, scaled to the front."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from string import ascii_uppercase
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.desk.presenters.front_columns import FrontColumn, knee_index
from railui.desk.presenters.search_history import SearchHistory
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot_data import Line, Mark, PlotData

MARGIN: Final = 0.08  # of the range of the front, around it
SHOWN_PERCENTILE: Final = 90  # of the evaluated designs, where all are shown: a few distant ones would hide the rest
SELECTED: Final = "series3"  # role of the selected design
LOG_RATIO: Final = 8.0  # of the ends of the shown range, from which the axis of a variable is logarithmic


@dataclass(frozen=True)
class Pin:
    """Design that stays marked on the front; values: its quantities in the order of the table."""

    letter: str
    variables: dict[str, float]
    values: list[float]


def free_letter(pins: Sequence[Pin]) -> str:
    """Return the first letter that no pin has.

    >>> free_letter([Pin("A", {}, [])])
    'B'
    """
    used = {pin.letter for pin in pins}
    return next((letter for letter in ascii_uppercase if letter not in used), "?")


def pin_marks(pins: Sequence[Pin], x: int, y: int) -> list[Mark]:
    """Return the marks of pinned designs over two quantities."""
    return [Mark(p.values[x], p.values[y], p.letter, "", "limit") for p in pins if max(x, y) < len(p.values)]


def front_plot(
    history: SearchHistory, columns: list[FrontColumn], x: int, y: int, index: int, show_all: bool = False
) -> PlotData:
    """Plot the front, the other feasible designs, the baseline, and the selected design with its spread.

    Parameters
    ----------
    history : SearchHistory
        Search.
    columns : list of FrontColumn
        Quantities of the designs, see `front_columns`.
    x, y : int
        Numbers of the quantities on the axes.
    index : int
        Number of the selected design.
    show_all : bool
        Scale the axes to all feasible designs and the baseline instead of the front.
    """
    pair = columns[x], columns[y]
    axes = _axis(pair[0], show_all), _axis(pair[1], show_all)
    lines: list[Line] = []
    marks: list[Mark] = []
    cloud = np.stack([column.evaluated for column in pair], axis=1)
    inside = _inside(cloud, axes)
    if np.any(inside):
        lines.append(Line(cloud[inside, 0], cloud[inside, 1], "evaluated", "base", is_points=True))
    values = np.stack([column.values for column in pair], axis=1)
    if len(values):
        is_curve = len(history.plan.objectives) == 2 and {x, y} == {0, 1}
        lines.append(Line(values[:, 0], values[:, 1], "front", "current", is_points=not is_curve))
        marks += [Mark(a, b, "•", role="current") for a, b in values.tolist()]
    marks += _baseline_marks(pair, axes)
    best = knee_index(history)
    if best is not None and best < len(values) and best != index:
        marks.append(Mark(float(values[best, 0]), float(values[best, 1]), "◆", "knee", "other"))
    if index < len(values):
        lines += _spread_lines(history, pair, (x, y), index, axes)
        marks.append(Mark(float(values[index, 0]), float(values[index, 1]), "◉", f"design {index}", SELECTED))
    return PlotData(*axes, lines, marks=marks, placeholder="no feasible design yet")


def _axis(column: FrontColumn, show_all: bool) -> Axis:
    """Return the axis of a quantity, with ends at those of the front."""
    values = column.values[np.isfinite(column.values)]
    everything = column.evaluated[np.isfinite(column.evaluated)]
    if (show_all or len(values) < 2 or np.ptp(values) == 0) and len(everything):
        ends = np.percentile(everything, [100 - SHOWN_PERCENTILE, SHOWN_PERCENTILE])
        values = np.concatenate([values, ends, [column.baseline] if np.isfinite(column.baseline) else []])
    unit = column.unit
    if not len(values) or np.ptp(values) == 0:
        return Axis(column.name, unit)
    low, high = float(values.min()), float(values.max())
    if column.kind == "variable" and low > 0 and high > LOG_RATIO * low:
        factor = (high / low) ** MARGIN
        return Axis(column.name, unit, log=True, low=low / factor, high=high * factor)
    margin = MARGIN * (high - low)
    return Axis(column.name, unit, low=low - margin, high=high + margin)


def _inside(points: FloatArray, axes: tuple[Axis, Axis]) -> NDArray[np.bool_]:
    inside: NDArray[np.bool_] = np.all(np.isfinite(points), axis=1)
    for column, axis in zip(points.T, axes, strict=True):
        if axis.low is not None and axis.high is not None:
            inside &= (column >= axis.low) & (column <= axis.high)
    return inside


def _baseline_marks(pair: tuple[FrontColumn, FrontColumn], axes: tuple[Axis, Axis]) -> list[Mark]:
    """Return the mark of the baseline; beyond the axes, an arrow at the edge with its values."""
    x, y = (column.baseline for column in pair)
    if not (np.isfinite(x) and np.isfinite(y)):
        return []
    ends = [(axis.low, axis.high) for axis in axes]
    if any(low is None or high is None for low, high in ends):
        return [Mark(x, y, "x", "baseline", "other")]
    (left, right), (bottom, top) = ((float(low or 0.0), float(high or 0.0)) for low, high in ends)
    if left <= x <= right and bottom <= y <= top:
        return [Mark(x, y, "x", "baseline", "other")]
    arrow = "←" if x < left else "→" if x > right else "↓" if y < bottom else "↑"
    text = f"baseline {x:.3g}, {y:.3g}"
    return [Mark(min(right, max(left, x)), min(top, max(bottom, y)), arrow, text, "other")]


def _spread_lines(
    history: SearchHistory,
    pair: tuple[FrontColumn, FrontColumn],
    numbers: tuple[int, int],
    index: int,
    axes: tuple[Axis, Axis],
) -> list[Line]:
    """Return a cross of one standard deviation about the mean of objectives on new seeds."""
    statistics = history.fresh_statistics(index)
    if statistics is None or any(column.kind != "objective" for column in pair):
        return []
    (x, dx), (y, dy) = (
        (column.factor * float(statistics[0][i]), column.factor * float(statistics[1][i]))
        for column, i in zip(pair, numbers, strict=True)
    )
    crosses = [np.array([[x - dx, y], [x + dx, y]]), np.array([[x, y - dy], [x, y + dy]])]
    is_shown = bool(np.any(_inside(np.array([[x, y]]), axes)))
    label = "new seeds" if is_shown else "new seeds: beyond the axes"
    return [Line(ends[:, 0], ends[:, 1], label, SELECTED) for ends in crosses]
