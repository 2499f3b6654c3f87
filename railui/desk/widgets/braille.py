"""Lines as dots in character cells, two wide and four high: thinned, clipped and set as whole arrays."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray

Cells = NDArray[np.uint8]

WIDE, HIGH = 2, 4  # dots of a cell
# bit of each dot [row, column] in the braille block of Unicode
BITS: Final = np.array([[1, 8], [2, 16], [4, 32], [64, 128]], dtype=np.uint8)
BLANK: Final = 0x2800


def thinned(x: FloatArray, y: FloatArray, columns: int) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    """A line [n] with first, least, greatest and last of every column of dots, and the run that each point is in.

    x counts dots from the left. A run ends where a value is not finite: no line is drawn over a gap.
    """
    whole = np.isfinite(x) & np.isfinite(y)
    run = np.asarray(np.cumsum(~whole)[whole], dtype=np.int64)
    x, y = x[whole], y[whole]
    if len(x) <= 4 * columns or np.any(np.diff(x) < 0):
        return x, y, run
    column = np.floor(x).astype(np.int64)
    starts = np.flatnonzero(np.r_[True, (np.diff(column) != 0) | (np.diff(run) != 0)])
    ends = np.r_[starts[1:], len(x)] - 1
    four = [y[starts], np.minimum.reduceat(y, starts), np.maximum.reduceat(y, starts), y[ends]]
    return np.repeat(x[starts], 4), np.stack(four, axis=1).ravel(), np.repeat(run[starts], 4)


def drawn(x: FloatArray, y: FloatArray, width: int, height: int) -> Cells:
    """A line as cells [height, width] of braille bits; x, y in dots from the upper left corner."""
    wide, high = WIDE * width, HIGH * height
    x, y, run = thinned(np.asarray(x, dtype=float), np.asarray(y, dtype=float), wide)
    if not len(x):
        return np.zeros((height, width), dtype=np.uint8)
    joined = np.diff(run) == 0
    ax, ay, bx, by = x[:-1][joined], y[:-1][joined], x[1:][joined], y[1:][joined]
    lone = np.r_[True, ~joined] & np.r_[~joined, True]
    ax, ay, bx, by = np.r_[ax, x[lone]], np.r_[ay, y[lone]], np.r_[bx, x[lone]], np.r_[by, y[lone]]
    ax, ay, bx, by = _clipped(ax, ay, bx, by, wide - 1e-6, high - 1e-6)
    return _set(*_stepped(ax, ay, bx, by), width, height)


def points(x: FloatArray, y: FloatArray, width: int, height: int) -> Cells:
    """Points as cells [height, width] of braille bits."""
    inside = np.isfinite(x) & np.isfinite(y) & (x >= 0) & (y >= 0) & (x < WIDE * width) & (y < HIGH * height)
    return _set(x[inside], y[inside], width, height)


def _clipped(
    ax: FloatArray, ay: FloatArray, bx: FloatArray, by: FloatArray, wide: float, high: float
) -> tuple[FloatArray, ...]:
    """Segments cut at the frame; those outside are left out (Liang and Barsky 1984)."""
    dx, dy = bx - ax, by - ay
    enter, leave = np.zeros_like(ax), np.ones_like(ax)
    out = np.zeros(len(ax), dtype=bool)
    for p, q in ((-dx, ax), (dx, wide - ax), (-dy, ay), (dy, high - ay)):
        still = p == 0
        out |= still & (q < 0)
        t = np.where(still, 0.0, q / np.where(still, 1.0, p))
        enter = np.where(p < 0, np.maximum(enter, t), enter)
        leave = np.where(p > 0, np.minimum(leave, t), leave)
    kept = ~out & (enter <= leave)
    ax, ay, dx, dy, enter, leave = (a[kept] for a in (ax, ay, dx, dy, enter, leave))
    return ax + enter * dx, ay + enter * dy, ax + leave * dx, ay + leave * dy


def _stepped(ax: FloatArray, ay: FloatArray, bx: FloatArray, by: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Every dot of segments, one step along the longer side each."""
    count = np.ceil(np.maximum(np.abs(bx - ax), np.abs(by - ay))).astype(np.int64) + 1
    which = np.repeat(np.arange(len(ax)), count)
    first = np.repeat(np.cumsum(count) - count, count)
    t = (np.arange(len(which)) - first) / np.maximum(count[which] - 1, 1)
    return ax[which] + t * (bx - ax)[which], ay[which] + t * (by - ay)[which]


def _set(x: FloatArray, y: FloatArray, width: int, height: int) -> Cells:
    dots = np.zeros((HIGH * height, WIDE * width), dtype=np.uint8)
    # a cut that was rounded may stand on the edge itself
    rows, columns = (np.clip(a, 0, most - 1).astype(np.int64) for a, most in zip((y, x), dots.shape, strict=True))
    dots[rows, columns] = 1
    four = dots.reshape(height, HIGH, width, WIDE)
    return np.asarray((four * BITS[None, :, None, :]).sum(axis=(1, 3)), dtype=np.uint8)
