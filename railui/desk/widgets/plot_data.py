"""Data of a plot: lines, limits and markers over two axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from railui.arrays import FloatArray
from railui.desk.widgets.axis import Axis


@dataclass(frozen=True, eq=False)
class Line:
    """Line or points of a plot; the role selects the style: current, base, other, limit."""

    x: FloatArray
    y: FloatArray
    label: str = ""
    role: str = "current"
    is_points: bool = False


@dataclass(frozen=True)
class LimitLine:
    """Limit at a value of the vertical axis, or of the horizontal axis if `is_vertical`."""

    value: float
    label: str = ""
    is_vertical: bool = False


@dataclass(frozen=True)
class Mark:
    """Character at a point with a label."""

    x: float
    y: float
    character: str
    label: str = ""
    role: str = "limit"


@dataclass(frozen=True, eq=False)
class PlotData:
    """Data of a plot; the placeholder is shown if there are no lines."""

    x: Axis
    y: Axis
    lines: Sequence[Line] = ()
    limits: Sequence[LimitLine] = ()
    marks: Sequence[Mark] = ()
    placeholder: str = ""
