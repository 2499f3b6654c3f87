"""What a plot shows: lines, limits and letters over two axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from railui.arrays import FloatArray
from railui.desk.widgets.axis import Axis


@dataclass(frozen=True, eq=False)
class Line:
    """A line (or points) of a picture: its role names its colour."""

    x: FloatArray
    y: FloatArray
    label: str = ""
    role: str = "now"
    points: bool = False


@dataclass(frozen=True)
class Level:
    """A limit across the picture, at a value of the vertical axis (or of the horizontal one: `upright`)."""

    value: float
    label: str = ""
    upright: bool = False


@dataclass(frozen=True)
class Mark:
    """A letter at a point, with a word beside it."""

    x: float
    y: float
    letter: str
    label: str = ""
    role: str = "limit"


@dataclass(frozen=True, eq=False)
class Picture:
    """What a plot shows. `wait` is said where there are no lines yet."""

    x: Axis
    y: Axis
    lines: Sequence[Line] = ()
    levels: Sequence[Level] = ()
    marks: Sequence[Mark] = ()
    wait: str = ""
