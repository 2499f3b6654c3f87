"""Rasterisation of lines and points into braille characters (two by four dots) with array operations."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray

Cells = NDArray[np.uint8]

DOT_COLUMNS, DOT_ROWS = 2, 4  # dots of a character cell
# bit of each dot [row, column] in the braille block of Unicode
DOT_BITS: Final = np.array([[1, 8], [2, 16], [4, 32], [64, 128]], dtype=np.uint8)
BLANK_CODE_POINT: Final = 0x2800


def decimate_min_max(x: FloatArray, y: FloatArray, columns: int) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    """Reduce a line [n] to the first, minimum, maximum and last value in every column of dots.

    x in dots from the left. Also returns the section index of every point: a section ends at a value that is not
    finite, so that no line is drawn across a gap.
    """
    is_finite = np.isfinite(x) & np.isfinite(y)
    section = np.asarray(np.cumsum(~is_finite)[is_finite], dtype=np.int64)
    x, y = x[is_finite], y[is_finite]
    if len(x) <= 4 * columns or np.any(np.diff(x) < 0):
        return x, y, section
    column = np.floor(x).astype(np.int64)
    starts = np.flatnonzero(np.r_[True, (np.diff(column) != 0) | (np.diff(section) != 0)])
    ends = np.r_[starts[1:], len(x)] - 1
    four = [y[starts], np.minimum.reduceat(y, starts), np.maximum.reduceat(y, starts), y[ends]]
    return np.repeat(x[starts], 4), np.stack(four, axis=1).ravel(), np.repeat(section[starts], 4)


def rasterise_line(x: FloatArray, y: FloatArray, width: int, height: int) -> Cells:
    """Return a line as cells [height, width] of braille bits; x, y in dots from the upper left corner."""
    wide, high = DOT_COLUMNS * width, DOT_ROWS * height
    x, y, section = decimate_min_max(np.asarray(x, dtype=float), np.asarray(y, dtype=float), wide)
    if not len(x):
        return np.zeros((height, width), dtype=np.uint8)
    joined = np.diff(section) == 0
    ax, ay, bx, by = x[:-1][joined], y[:-1][joined], x[1:][joined], y[1:][joined]
    isolated = np.r_[True, ~joined] & np.r_[~joined, True]
    ax, ay, bx, by = np.r_[ax, x[isolated]], np.r_[ay, y[isolated]], np.r_[bx, x[isolated]], np.r_[by, y[isolated]]
    ax, ay, bx, by = _clip(ax, ay, bx, by, wide - 1e-6, high - 1e-6)
    return _to_cells(*_trace_dots(ax, ay, bx, by), width, height)


def rasterise_points(x: FloatArray, y: FloatArray, width: int, height: int) -> Cells:
    """Return points as cells [height, width] of braille bits."""
    inside = np.isfinite(x) & np.isfinite(y) & (x >= 0) & (y >= 0) & (x < DOT_COLUMNS * width) & (y < DOT_ROWS * height)
    return _to_cells(x[inside], y[inside], width, height)


def rasterise_band(low: FloatArray, high: FloatArray, width: int, height: int) -> Cells:
    """Return the area between two lines as cells; low, high [column of dots] in dots from the upper edge, low below.

    A column whose ends are not finite stays empty; any other has at least one dot.
    """
    rows = np.arange(DOT_ROWS * height)[:, None]
    with np.errstate(invalid="ignore"):
        dots = (rows >= np.floor(high)[None]) & (rows <= np.floor(low)[None])
    y, x = np.nonzero(dots)
    return _to_cells(x.astype(float), y.astype(float), width, height)


def _clip(
    ax: FloatArray, ay: FloatArray, bx: FloatArray, by: FloatArray, wide: float, high: float
) -> tuple[FloatArray, ...]:
    """Clip line segments to the frame and drop those outside (Liang and Barsky 1984)."""
    dx, dy = bx - ax, by - ay
    enter, leave = np.zeros_like(ax), np.ones_like(ax)
    out = np.zeros(len(ax), dtype=bool)
    for p, q in ((-dx, ax), (dx, wide - ax), (-dy, ay), (dy, high - ay)):
        is_parallel = p == 0
        out |= is_parallel & (q < 0)
        t = np.where(is_parallel, 0.0, q / np.where(is_parallel, 1.0, p))
        enter = np.where(p < 0, np.maximum(enter, t), enter)
        leave = np.where(p > 0, np.minimum(leave, t), leave)
    visible = ~out & (enter <= leave)
    ax, ay, dx, dy, enter, leave = (a[visible] for a in (ax, ay, dx, dy, enter, leave))
    return ax + enter * dx, ay + enter * dy, ax + leave * dx, ay + leave * dy


def _trace_dots(ax: FloatArray, ay: FloatArray, bx: FloatArray, by: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return every dot of line segments, in steps of one dot along the longer side."""
    count = np.ceil(np.maximum(np.abs(bx - ax), np.abs(by - ay))).astype(np.int64) + 1
    which = np.repeat(np.arange(len(ax)), count)
    first = np.repeat(np.cumsum(count) - count, count)
    t = (np.arange(len(which)) - first) / np.maximum(count[which] - 1, 1)
    return ax[which] + t * (bx - ax)[which], ay[which] + t * (by - ay)[which]


def _to_cells(x: FloatArray, y: FloatArray, width: int, height: int) -> Cells:
    dots = np.zeros((DOT_ROWS * height, DOT_COLUMNS * width), dtype=np.uint8)
    # a clipped end may be rounded onto the edge
    rows, columns = (np.clip(a, 0, most - 1).astype(np.int64) for a, most in zip((y, x), dots.shape, strict=True))
    dots[rows, columns] = 1
    four = dots.reshape(height, DOT_ROWS, width, DOT_COLUMNS)
    return np.asarray((four * DOT_BITS[None, :, None, :]).sum(axis=(1, 3)), dtype=np.uint8)
