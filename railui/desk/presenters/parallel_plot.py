"""Parallel co-ordinates of a front: an axis for every quantity, a line for every design."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from railui.desk.presenters.front_columns import FrontColumn
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot_data import LimitLine, Line, PlotData

MAX_LINES: Final = 60


def parallel_plot(columns: Sequence[FrontColumn], rows: Sequence[int], index: int) -> PlotData:
    """Plot every shown design over all quantities, each from its smallest to its largest value on the front.

    Parameters
    ----------
    columns
        Quantities of the front.
    rows
        Numbers of the designs that are shown; at most MAX_LINES of them are drawn.
    index
        Number of the selected design.
    """
    if not columns or not len(columns[0].values):
        return PlotData(Axis(""), Axis(""), placeholder="no feasible design yet")
    scaled = np.stack([_scaled(column) for column in columns], axis=1)
    x = np.arange(len(columns), dtype=float)
    step = max(1, -(-len(rows) // MAX_LINES))
    others = [row for row in rows[::step] if row != index]
    lines = [Line(x, scaled[row], "designs" if k == 0 else "", "base") for k, row in enumerate(others)]
    if index < len(scaled):
        lines.append(Line(x, scaled[index], f"design {index}", "series3"))
    limits = [LimitLine(float(k), is_vertical=True, role="base") for k in range(len(columns))]
    names = tuple(column.symbol or column.name for column in columns)
    horizontal = Axis("", low=-0.5, high=len(columns) - 0.5, categories=names)
    vertical = Axis("smallest (0) to largest (1)", low=-0.05, high=1.05)
    return PlotData(horizontal, vertical, lines, limits)


def _scaled(column: FrontColumn) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Return the values from 0 to 1; one half for a quantity that does not vary."""
    values = np.asarray(column.values, dtype=float)
    finite = values[np.isfinite(values)]
    if not len(finite) or np.ptp(finite) == 0:
        return np.where(np.isfinite(values), 0.5, np.nan)
    return np.asarray((values - finite.min()) / np.ptp(finite))
