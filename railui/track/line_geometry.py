"""Line with curves under a vehicle: offsets, headings and accelerations at the positions of its bodies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.core import Spline
from railui.track.line import Track

GRAVITY: Final = 9.81  # m/s^2
COMMON_COLUMNS: Final = ("g*phi", "V^2*phi''")  # of the cant under the middle of the vehicle
POSITION_COLUMNS: Final = ("curvature", "y", "dy", "psi", "dpsi", "V^2/R", "V^2*d(1/R)/ds")
CURVATURE, ACCELERATION = 0, 5  # among the columns of a position


class LinePositions(NamedTuple):
    """Wheelsets and positions [m] behind the first wheelset, the middle last; half the gauge b [m] of the cant."""

    wheelsets: tuple[float, ...]
    positions: tuple[float, ...]
    half_gauge: float


@dataclass(frozen=True, eq=False)
class LineAt:
    """Line at locations: heading theta [rad], its integral y [m], curvature [1/m] and its derivative [1/m^2]."""

    y: FloatArray
    theta: FloatArray
    curvature: FloatArray
    turning: FloatArray


class PlanLine:
    """Alignment in the plan: the curvature and its first and second integral over s, by a cubic spline.

    Beyond the ends of the track the curvature keeps its last value.
    """

    def __init__(self, s: FloatArray, curvature: FloatArray) -> None:
        self.s = s
        self.powers = Spline(s, curvature).coefficients[0]
        h = np.diff(s)
        c3, c2, c1, c0 = self.powers
        turn = (((c3 / 4 * h + c2 / 3) * h + c1 / 2) * h + c0) * h
        self.theta = np.concatenate([[0.0], np.cumsum(turn)])
        step = ((((c3 / 20 * h + c2 / 12) * h + c1 / 6) * h + c0 / 2) * h + self.theta[:-1]) * h
        self.y = np.concatenate([[0.0], np.cumsum(step)])
        self.ends = (float(curvature[0]), float(curvature[-1]))

    def at(self, s: FloatArray) -> LineAt:
        """Return the line at locations s [...] in m."""
        inside = np.clip(s, self.s[0], self.s[-1])
        i = np.clip(np.searchsorted(self.s, inside, side="right") - 1, 0, len(self.s) - 2)
        x = inside - self.s[i]
        c3, c2, c1, c0 = (power[i] for power in self.powers)
        curvature = ((c3 * x + c2) * x + c1) * x + c0
        theta = self.theta[i] + (((c3 / 4 * x + c2 / 3) * x + c1 / 2) * x + c0) * x
        y = self.y[i] + ((((c3 / 20 * x + c2 / 12) * x + c1 / 6) * x + c0 / 2) * x + self.theta[i]) * x
        beyond = s - inside
        end = np.where(beyond < 0, self.ends[0], self.ends[1])
        y = y + (theta + 0.5 * end * beyond) * beyond
        turning = np.where(beyond == 0.0, (3 * c3 * x + 2 * c2) * x + c1, 0.0)
        return LineAt(y, theta + end * beyond, np.where(beyond == 0.0, curvature, end), turning)


class CantAngle(NamedTuple):
    """Angle of the cant at locations, and its first and second derivative by s."""

    phi: FloatArray
    slope: FloatArray
    bend: FloatArray


class Cant:
    """Angle of the cant over half the gauge b [m] along a track, by a cubic spline; constant beyond its ends."""

    def __init__(self, track: Track, half_gauge: float) -> None:
        self.ends = track.s[0], track.s[-1]
        self.spline = Spline(track.s, track.cant / (2.0 * half_gauge))

    def at(self, s: FloatArray) -> CantAngle:
        """Return the angle at locations s [...] in m."""
        inside = np.clip(s, *self.ends)
        is_inside = inside == s
        slope, bend = (np.where(is_inside, self.spline(inside, order), 0.0) for order in (1, 2))
        return CantAngle(self.spline(inside), slope, bend)


def line_columns(track: Track, speed: float, s: FloatArray, places: LinePositions, cant: CantAngle) -> FloatArray:
    """Return the columns of a line behind those of a straight track, for the leading wheelset at s [row] in m.

    g phi and V^2 phi'' of the cant under the middle; at each position 1/R, the offset y and heading psi of the line
    against the tangent at the middle with their derivatives by s, V^2/R and V^2 d(1/R)/ds. cant: under the middle.
    """
    line, middle = PlanLine(track.s, track.curvature), s - places.positions[-1]
    reference = line.at(middle)
    columns = [GRAVITY * cant.phi, speed**2 * cant.bend]
    for behind in places.positions:
        here, ahead = line.at(s - behind), places.positions[-1] - behind
        heading = here.theta - reference.theta
        offset = here.y - reference.y - ahead * reference.theta
        drift = heading - ahead * reference.curvature
        turning = here.curvature - reference.curvature
        columns += [here.curvature, offset, drift, heading, turning]
        columns += [speed**2 * here.curvature, speed**2 * here.turning]
    return np.stack(columns, axis=1)


def curvature_columns(columns: int, wheelsets: int) -> list[int]:
    """Return the columns of the curvature at every position, of a table with so many columns and wheelsets."""
    straight = 4 + 5 * wheelsets
    return list(range(straight + len(COMMON_COLUMNS) + CURVATURE, columns, len(POSITION_COLUMNS)))


def add_twist(table: FloatArray, first: int, cant: CantAngle, middle: CantAngle) -> None:
    """Add the twist to cross-level and slope of a wheelset in a table: its cant less that under the middle."""
    table[:, first + 2] += cant.phi - middle.phi
    table[:, first + 3] += cant.slope - middle.slope


def steady_row(columns: int, places: LinePositions, curvature: float, acceleration: float) -> FloatArray:
    """Return the row of an input table in a curve of constant curvature [1/m]; acceleration V^2/R - g phi [m/s^2]."""
    row = np.zeros(columns)
    first = columns - len(POSITION_COLUMNS) * len(places.positions)
    for i, behind in enumerate(places.positions):
        x = places.positions[-1] - behind
        values = (curvature, 0.5 * x**2 * curvature, 0.0, x * curvature, 0.0, acceleration, 0.0)
        row[first + len(values) * i : first + len(values) * (i + 1)] = values
    return row


def cant_deficiency(track: Track, speed: float, half_gauge: float) -> FloatArray:
    """Return the cant deficiency [sample] in m at a speed [m/s], see `cant_deficiency_of`."""
    return cant_deficiency_of(track.curvature, track.cant, speed, half_gauge)


def cant_deficiency_of(
    curvature: FloatArray, cant: FloatArray, speed: float | FloatArray, half_gauge: float
) -> FloatArray:
    """Return the cant deficiency [sample] in m: 2 b V^2/(g R) - cant, outward positive.

    curvature [1/m], cant [m], speed [m/s]: [sample]. On straight track the sign is that of the lateral force to the
    left.
    """
    deficiency = 2.0 * half_gauge * np.square(speed) * curvature / GRAVITY - cant
    return np.asarray(np.where(curvature < 0.0, -deficiency, deficiency))
