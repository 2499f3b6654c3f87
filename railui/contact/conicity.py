"""Equivalent conicity by EN 15302, from rolling radii against displacement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray

AMPLITUDES = 1e-3 * np.arange(10, 101) / 10.0  # m: 1 to 10 mm by 0.1
POINTS = 4000  # of the integral over a quarter of a motion
HALVINGS = 60


class NoCentreError(ValueError):
    """The rolling radius difference has no zero: there is nothing round which a wheelset could run."""


@dataclass(frozen=True, eq=False)
class ConicityCurve:
    """tan gamma_e [n] against amplitude [m]; NaN where no motion goes round the centre; `centre` [m] of the motion.

    Amplitudes beyond the table are left out: `left_out` holds them.
    """

    amplitude: FloatArray
    tan_gamma: FloatArray
    centre: float
    omitted_amplitudes: FloatArray

    def at(self, amplitude: float) -> float:
        """tan gamma_e at an amplitude [m] of the list; NaN where it is not there."""
        near = np.flatnonzero(np.abs(self.amplitude - amplitude) < 1e-9)
        return float(self.tan_gamma[near[0]]) if len(near) else float("nan")


def equivalent_conicity(y: ArrayLike, delta_r: ArrayLike, amplitudes: ArrayLike = AMPLITUDES) -> ConicityCurve:
    """Equivalent conicity from r_1 - r_2 [m] at displacements y [m], which rise; amplitudes [m] are half the width.

    The undamped wheelset y'' = -delta_r(y)/(2 b r) is followed through one turn: psi^2/2 = C - S(y), S the integral of
    delta_r, gives its wavelength L (in units where 2 b r = 1), and tan gamma_e = 2 (pi/L)^2. A table whose zero is
    shifted (unequal diameters, worn sides) has its motion between two displacements of equal S about that zero.
    Nothing is made up beyond the table. NoCentre where delta_r never passes zero upwards; ValueError where y does not
    rise. Source: EN 15302, annex on the integration of the equation of motion.

    >>> y = np.linspace(-0.007, 0.007, 141)
    >>> round(equivalent_conicity(y, 2 * 0.05 * y).at(3e-3), 6)
    0.05
    """
    grid, table = np.asarray(y, dtype=float), np.asarray(delta_r, dtype=float)
    if len(grid) < 3 or grid.shape != table.shape or np.any(np.diff(grid) <= 0.0):
        raise ValueError("displacements must rise, with one rolling radius difference each, three or more")
    motion = _Motion(grid, table)
    asked = np.asarray(amplitudes, dtype=float)
    found = {float(a): motion.conicity(float(a)) for a in asked}
    kept = [a for a, value in found.items() if value is not None]
    return ConicityCurve(
        np.array(kept),
        np.array([found[a] for a in kept], dtype=float),
        motion.centre,
        np.array([a for a, value in found.items() if value is None]),
    )


def klingel_wavelength(half_gauge: float, rolling_radius: float, conicity: float) -> float | None:
    """L = 2 pi sqrt(b r/lambda) [m] of a free wheelset's kinematic motion; None where the conicity is not positive.

    >>> round(klingel_wavelength(0.75, 0.46, 0.1), 3)
    11.67
    """
    return float(2 * np.pi * np.sqrt(half_gauge * rolling_radius / conicity)) if conicity > 0 else None


class _Motion:
    """Motions round the centre of a table, linear between its points."""

    def __init__(self, y: FloatArray, table: FloatArray) -> None:
        self.centre = _centre(y, table)
        # with its zeros among the points, the energy rises or falls all through an interval
        passing = np.flatnonzero(table[:-1] * table[1:] < 0.0)
        zeros = y[passing] - table[passing] * np.diff(y)[passing] / np.diff(table)[passing]
        self.y, first = np.unique(np.concatenate([y, zeros, [self.centre]]), return_index=True)
        values = np.concatenate([table, np.zeros(len(zeros) + 1)])
        self.table = values[first]
        steps = 0.5 * (self.table[1:] + self.table[:-1]) * np.diff(self.y)
        self.sums = np.concatenate([[0.0], np.cumsum(steps)])
        middle = int(np.searchsorted(self.y, self.centre))
        self.sums -= self.sums[middle]
        self.sides = {
            1: (np.arange(middle, len(self.y)), np.maximum.accumulate(self.sums[middle:])),
            -1: (np.arange(middle, -1, -1), np.maximum.accumulate(self.sums[middle::-1])),
        }

    def energy(self, x: FloatArray) -> FloatArray:
        """S(x), the integral of the table from the centre."""
        k = np.clip(np.searchsorted(self.y, x, "right") - 1, 0, len(self.y) - 2)
        u = x - self.y[k]
        slope = (self.table[k + 1] - self.table[k]) / (self.y[k + 1] - self.y[k])
        return np.asarray(self.sums[k] + u * (self.table[k] + 0.5 * slope * u))

    def turning(self, level: float, side: int) -> float | None:
        """Where a motion of energy `level` turns on a side of the centre; None where it leaves the table."""
        points, reached = self.sides[side]
        i = int(np.searchsorted(reached, level, "right"))
        if i >= len(points):
            return None
        if i == 0:
            return self.centre
        before, behind = points[i - 1], points[i]
        # sums + t u + (dt/dy) u^2/2 = level, u from the point before
        left = level - self.sums[before]
        t = self.table[before]
        bend = (self.table[behind] - t) / (self.y[behind] - self.y[before])
        root = np.sqrt(max(t * t + 2.0 * bend * left, 0.0))
        divisor = t + side * root
        return float(self.y[before] + (2.0 * left / divisor if divisor else 0.0))

    def turns(self, level: float) -> tuple[float, float] | None:
        left, right = self.turning(level, -1), self.turning(level, 1)
        return None if left is None or right is None else (left, right)

    def conicity(self, amplitude: float) -> float | None:
        """tan gamma_e of the motion of a half width; NaN where none goes round the centre, None beyond the table."""
        if self.y[-1] - self.y[0] < 2.0 * amplitude * (1.0 - 1e-9):
            return None
        low, high = 0.0, float(min(self.sums[0], self.sums[-1]))
        highest = self.turns(high * (1.0 - 1e-12)) if high > 0.0 else None
        if highest is None or highest[1] - highest[0] < 2.0 * amplitude * (1.0 - 1e-9):
            return None
        turns = highest
        for _ in range(HALVINGS):
            level = 0.5 * (low + high)
            found = self.turns(level)
            wide = found is None or found[1] - found[0] > 2.0 * amplitude
            low, high = (low, level) if wide else (level, high)
            turns = found or turns
        if abs(turns[1] - turns[0] - 2.0 * amplitude) > 1e-3 * amplitude:
            return float("nan")
        return self._of(turns)

    def _of(self, turns: tuple[float, float]) -> float:
        left, right = turns
        middle, half = 0.5 * (left + right), 0.5 * (right - left)
        theta = np.pi * ((np.arange(POINTS) + 0.5) / POINTS - 0.5)
        x = middle + half * np.sin(theta)
        level = np.interp(x, [left, right], self.energy(np.array([left, right])))
        speed = np.sqrt(2.0 * np.maximum(level - self.energy(x), 0.0))
        with np.errstate(divide="ignore"):
            whole = half * np.cos(theta) / speed
        if not np.isfinite(whole).all():
            return float("nan")
        length = 2.0 * np.pi / POINTS * whole.sum()
        return float(2.0 * (np.pi / length) ** 2)


def _centre(y: FloatArray, table: FloatArray) -> float:
    """The middle one of the zeros of delta_r: what the motions of all sizes go round."""
    some = np.flatnonzero(table)
    turn = np.flatnonzero(np.sign(table[some[1:]]) != np.sign(table[some[:-1]]))
    zeros = [_zero(y, table, int(some[i]), int(some[i + 1])) for i in turn]
    if not zeros:
        sign = "zero" if not len(some) else "positive" if table[some[0]] > 0 else "negative"
        raise NoCentreError(
            f"the rolling radius difference is {sign} from {y[0] * 1e3:g} to {y[-1] * 1e3:g} mm: "
            "the wheelset has no centre in this table"
        )
    if table[some[turn[0]]] > 0.0:
        raise NoCentreError(
            f"the rolling radius difference falls through zero at {zeros[0] * 1e3:.3g} mm: the wheelset runs away from "
            "it; r_1 - r_2 must be positive where the wheelset stands to the right"
        )
    return zeros[len(zeros) // 2]


def _zero(y: FloatArray, table: FloatArray, i: int, j: int) -> float:
    """Between two points of opposite sign; the middle of a stretch of zeros."""
    if j > i + 1:
        return float(0.5 * (y[i + 1] + y[j - 1]))
    return float(y[i] - table[i] * (y[j] - y[i]) / (table[j] - table[i]))
