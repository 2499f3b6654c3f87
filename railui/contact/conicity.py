"""Equivalent conicity by EN 15302 from rolling radii over displacement, and Klingel's wavelength."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray

AMPLITUDES = 1e-3 * np.arange(10, 101) / 10.0  # m: 1 to 10 mm by 0.1
QUADRATURE_POINTS = 4000  # of the integral over half a period
MAX_BISECTIONS = 60
AMPLITUDE_TOLERANCE = 1e-3  # relative


class NoCentreError(ValueError):
    """The rolling radius difference has no zero, so that the wheelset has no centre of motion."""


@dataclass(frozen=True, eq=False)
class ConicityCurve:
    """Equivalent conicity tan gamma_e [n] over amplitude [n] in m; NaN if no motion goes round the centre.

    `centre`: centre of the motion [m]; `omitted_amplitudes`: amplitudes [m] beyond the table.
    """

    amplitude: FloatArray
    tan_gamma: FloatArray
    centre: float
    omitted_amplitudes: FloatArray

    def at(self, amplitude: float) -> float:
        """Return tan gamma_e at one of the amplitudes [m]; NaN for any other."""
        near = np.flatnonzero(np.abs(self.amplitude - amplitude) < 1e-9)
        return float(self.tan_gamma[near[0]]) if len(near) else float("nan")


def equivalent_conicity(y: ArrayLike, delta_r: ArrayLike, amplitudes: ArrayLike = AMPLITUDES) -> ConicityCurve:
    """Compute the equivalent conicity from r_1 - r_2 over displacement.

    One period of the undamped wheelset y'' = -delta_r(y)/(2 b r) is integrated: psi^2/2 = C - S(y), S the integral of
    delta_r, gives its wavelength L (in units where 2 b r = 1), and tan gamma_e = 2 (pi/L)^2. If the zero of the table
    is shifted (unequal diameters, worn sides), the motion lies between two displacements of equal S about that zero.
    The table is not extrapolated.

    Parameters
    ----------
    y : array_like
        Displacements [m], increasing.
    delta_r : array_like
        Rolling radius differences r_1 - r_2 [m].
    amplitudes : array_like
        Amplitudes [m], half the width of the motion.

    Raises
    ------
    NoCentreError
        If delta_r never passes zero upward.
    ValueError
        If y does not increase.

    References
    ----------
    EN 15302, annex on the integration of the equation of motion.

    Examples
    --------
    >>> y = np.linspace(-0.007, 0.007, 141)
    >>> round(equivalent_conicity(y, 2 * 0.05 * y).at(3e-3), 6)
    0.05
    """
    grid, table = np.asarray(y, dtype=float), np.asarray(delta_r, dtype=float)
    if len(grid) < 3 or grid.shape != table.shape or np.any(np.diff(grid) <= 0.0):
        raise ValueError("displacements must increase, with one rolling radius difference each, three or more")
    motion = _Motion(grid, table)
    values = {float(a): motion.conicity(float(a)) for a in np.asarray(amplitudes, dtype=float)}
    inside = [a for a, value in values.items() if value is not None]
    return ConicityCurve(
        np.array(inside),
        np.array([values[a] for a in inside], dtype=float),
        motion.centre,
        np.array([a for a, value in values.items() if value is None]),
    )


def klingel_wavelength(half_gauge: float, rolling_radius: float, conicity: float) -> float | None:
    """Return L = 2 pi sqrt(b r/lambda) [m] of the kinematic motion of a free wheelset; None unless lambda > 0.

    >>> round(klingel_wavelength(0.75, 0.46, 0.1), 3)
    11.67
    """
    return float(2 * np.pi * np.sqrt(half_gauge * rolling_radius / conicity)) if conicity > 0 else None


class _Motion:
    """Motions round the centre of a table that is linear between its points."""

    def __init__(self, y: FloatArray, table: FloatArray) -> None:
        self.centre = _centre(y, table)
        # with its zeros among the points, the energy is monotonic within an interval
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
        """Return S(x), the integral of the table from the centre."""
        k = np.clip(np.searchsorted(self.y, x, "right") - 1, 0, len(self.y) - 2)
        u = x - self.y[k]
        slope = (self.table[k + 1] - self.table[k]) / (self.y[k + 1] - self.y[k])
        return np.asarray(self.sums[k] + u * (self.table[k] + 0.5 * slope * u))

    def turning_point(self, level: float, side: int) -> float | None:
        """Return the turning point of a motion of energy `level` on a side of the centre; None beyond the table."""
        points, reached = self.sides[side]
        i = int(np.searchsorted(reached, level, "right"))
        if i >= len(points):
            return None
        if i == 0:
            return self.centre
        before, behind = points[i - 1], points[i]
        # sums + t u + (dt/dy) u^2/2 = level, u from the point before
        remaining = level - self.sums[before]
        t = self.table[before]
        bend = (self.table[behind] - t) / (self.y[behind] - self.y[before])
        root = np.sqrt(max(t * t + 2.0 * bend * remaining, 0.0))
        divisor = t + side * root
        return float(self.y[before] + (2.0 * remaining / divisor if divisor else 0.0))

    def turning_points(self, level: float) -> tuple[float, float] | None:
        """Return both turning points; None beyond the table."""
        left, right = self.turning_point(level, -1), self.turning_point(level, 1)
        return None if left is None or right is None else (left, right)

    def conicity(self, amplitude: float) -> float | None:
        """Return tan gamma_e for an amplitude [m]; NaN if no motion goes round the centre, None beyond the table."""
        if self.y[-1] - self.y[0] < 2.0 * amplitude * (1.0 - 1e-9):
            return None
        low, high = 0.0, float(min(self.sums[0], self.sums[-1]))
        highest = self.turning_points(high * (1.0 - 1e-12)) if high > 0.0 else None
        if highest is None or highest[1] - highest[0] < 2.0 * amplitude * (1.0 - 1e-9):
            return None
        turns = highest
        for _ in range(MAX_BISECTIONS):
            level = 0.5 * (low + high)
            tried = self.turning_points(level)
            is_too_wide = tried is None or tried[1] - tried[0] > 2.0 * amplitude
            low, high = (low, level) if is_too_wide else (level, high)
            turns = tried or turns
        if abs(turns[1] - turns[0] - 2.0 * amplitude) > AMPLITUDE_TOLERANCE * amplitude:
            return float("nan")
        return self._conicity_between(turns)

    def _conicity_between(self, turns: tuple[float, float]) -> float:
        """Return tan gamma_e of the motion between two turning points by quadrature."""
        left, right = turns
        middle, half = 0.5 * (left + right), 0.5 * (right - left)
        theta = np.pi * ((np.arange(QUADRATURE_POINTS) + 0.5) / QUADRATURE_POINTS - 0.5)
        x = middle + half * np.sin(theta)
        level = np.interp(x, [left, right], self.energy(np.array([left, right])))
        speed = np.sqrt(2.0 * np.maximum(level - self.energy(x), 0.0))
        with np.errstate(divide="ignore"):
            integrand = half * np.cos(theta) / speed
        if not np.isfinite(integrand).all():
            return float("nan")
        length = 2.0 * np.pi / QUADRATURE_POINTS * integrand.sum()
        return float(2.0 * (np.pi / length) ** 2)


def _centre(y: FloatArray, table: FloatArray) -> float:
    """Return the middle zero of delta_r, the centre of motions of all amplitudes."""
    nonzero = np.flatnonzero(table)
    sign_changes = np.flatnonzero(np.sign(table[nonzero[1:]]) != np.sign(table[nonzero[:-1]]))
    zeros = [_zero(y, table, int(nonzero[i]), int(nonzero[i + 1])) for i in sign_changes]
    if not zeros:
        sign = "zero" if not len(nonzero) else "positive" if table[nonzero[0]] > 0 else "negative"
        raise NoCentreError(
            f"the rolling radius difference is {sign} from {y[0] * 1e3:g} to {y[-1] * 1e3:g} mm: "
            "the wheelset has no centre in this table"
        )
    if table[nonzero[sign_changes[0]]] > 0.0:
        raise NoCentreError(
            f"the rolling radius difference falls through zero at {zeros[0] * 1e3:.3g} mm: the wheelset runs away from "
            "it; r_1 - r_2 must be positive where the wheelset is displaced to the right"
        )
    return zeros[len(zeros) // 2]


def _zero(y: FloatArray, table: FloatArray, i: int, j: int) -> float:
    """Return the zero between two points of opposite sign; the middle of a range of zeros."""
    if j > i + 1:
        return float(0.5 * (y[i + 1] + y[j - 1]))
    return float(y[i] - table[i] * (y[j] - y[i]) / (table[j] - table[i]))
