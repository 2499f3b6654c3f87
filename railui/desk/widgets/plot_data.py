"""Data of a plot: lines, bands, limits and marks over two axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.arrays import FloatArray
from railui.desk.widgets.axis import Axis

SERIES_COUNT: Final = 6  # distinguishable colours for the lines of one plot
ROLES: Final = ("current", "base", "other", "limit", *(f"series{k}" for k in range(1, SERIES_COUNT + 1)))


def series_role(index: int) -> str:
    """Return the role of the line with a number from 0; the colours are used again after the last one."""
    return f"series{index % SERIES_COUNT + 1}"


@dataclass(frozen=True, eq=False)
class Line:
    """Line or points of a plot; the role, one of ROLES, selects the style."""

    x: FloatArray
    y: FloatArray
    label: str = ""
    role: str = "current"
    is_points: bool = False


@dataclass(frozen=True, eq=False)
class Band:
    """Shaded area between two lines over the same points, of the role current or base."""

    x: FloatArray
    low: FloatArray
    high: FloatArray
    label: str = ""
    role: str = "current"


@dataclass(frozen=True)
class LimitLine:
    """Limit at a value of the vertical axis, or of the horizontal axis if `is_vertical`."""

    value: float
    label: str = ""
    is_vertical: bool = False
    role: str = "limit"


@dataclass(frozen=True)
class Mark:
    """Character at a point with a label."""

    x: float
    y: float
    character: str
    label: str = ""
    role: str = "limit"


@dataclass(frozen=True, eq=False)
class Difference:
    """Difference of two lines, drawn in a strip of its own below the plot: x, y, the unit of y and a name."""

    x: FloatArray
    y: FloatArray
    unit: str = ""
    name: str = "current - base"

    @property
    def label(self) -> str:
        """Name with the ends of the range."""
        finite = self.y[np.isfinite(self.y)]
        if not len(finite):
            return ""
        return f"{self.name}: {finite.min():+.3g} to {finite.max():+.3g} {self.unit}".rstrip()


@dataclass(frozen=True, eq=False)
class PlotData:
    """Data of a plot; the placeholder is shown if there are neither lines nor bands."""

    x: Axis
    y: Axis
    lines: Sequence[Line] = ()
    limits: Sequence[LimitLine] = ()
    marks: Sequence[Mark] = ()
    placeholder: str = ""
    bands: Sequence[Band] = ()
    difference: Difference | None = None


def drawn_lines(data: PlotData) -> list[Line]:
    """Return the lines of a plot and the edges of its bands, as its tables list them."""
    edges = [
        Line(band.x, y, f"{band.label or band.role} {end}", band.role)
        for band in data.bands
        for end, y in (("lowest", band.low), ("highest", band.high))
    ]
    return [*data.lines, *edges]
