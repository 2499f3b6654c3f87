"""Rigid contact of a wheelset on its track: contact points and roll over lateral displacement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.contact.geometry import FLANGE_ANGLE, ContactGeometry
from railui.contact.profile import RESAMPLING_STEP, ProfileError
from railui.contact.wheelset_on_track import ProfileCurve, WheelRailPair

MAX_DISPLACEMENT = 0.015  # m
DISPLACEMENT_STEP = 1e-4  # m
END_MARGIN = 3e-4  # m from the end of a profile within which a contact is invalid
MAX_ITERATIONS = 25
GAP_TOLERANCE = 2e-9  # m, between the gaps of both wheels
FLANGE_TIP = -0.045  # m from the tape line, inside which the wheel touches with the tip of its flange


def find_contacts(
    pair: WheelRailPair, reach: float = MAX_DISPLACEMENT, step: float = DISPLACEMENT_STEP
) -> ContactGeometry:
    """Compute rigid contact with roll over displacement: the wheelset rests on both rails at once.

    Roll brings the gaps of both wheels to the same height. Where a contact leaves a profile, the search ends with a
    note.

    Parameters
    ----------
    pair : WheelRailPair
        Profiles and their position.
    reach : float
        Largest displacement to either side [m].
    step : float
        Step of displacement [m].

    Raises
    ------
    ProfileError
        If the wheelset cannot run on this track at all.

    References
    ----------
    Broersen 1976, 2.2.
    """
    right = _Side.from_profiles(pair, *pair.curves(0))
    sides = right, (right if pair.has_equal_sides else _Side.from_profiles(pair, *pair.curves(1)))
    count = round(reach / step)
    grid = step * np.arange(-count, count + 1)
    points: dict[int, tuple[float, _ContactPoint, _ContactPoint]] = {}
    notes = []
    centre = _solve_roll(sides, pair, 0.0, 0.0)
    _check_centre(pair, centre)
    for direction in (1, -1):
        roll = centre[0]
        for k in range(0, count + 1):
            state = centre if k == 0 else _solve_roll(sides, pair, direction * step * k, roll)
            roll = state[0]
            ended = next((n for n, point in (("right", state[1]), ("left", state[2])) if point.end), None)
            if ended:
                ends = grid[count + direction * k] * 1e3
                profile = state[1].end or state[2].end
                notes.append(f"beyond {ends:.1f} mm the {ended} wheel touches at the end of the {profile}")
                break
            points[count + direction * k] = state
    order = sorted(points)
    both = [[points[i][1] for i in order], [points[i][2] for i in order]]

    def take(name: str) -> FloatArray:
        return np.array([[getattr(point, name) for point in row] for row in both])

    delta = 0.25 * pair.diameter_difference
    radius = -take("height") - pair.radius + np.array([[delta], [-delta]])
    return ContactGeometry(
        pair, np.asarray(grid[order], dtype=np.float64), radius, np.arctan(take("slope")), take("wheel"), take("rail"),
        np.array([points[i][0] for i in order]), tuple(notes),
    )  # fmt: skip


@dataclass(frozen=True)
class _ContactPoint:
    """Contact point of a wheel: gap, points on rail and wheel, slope, and the profile that ends there."""

    gap: float
    rail: float
    wheel: float
    height: float
    slope: float
    end: str


@dataclass(frozen=True, eq=False)
class _Side:
    """One side of the track: points of the wheel in axle co-ordinates, the rail on an even grid."""

    y: FloatArray
    below: FloatArray  # height of the points of the wheel relative to the axle
    x: FloatArray
    rail: FloatArray
    slope: FloatArray

    @classmethod
    def from_profiles(cls, pair: WheelRailPair, wheel: ProfileCurve, rail: ProfileCurve) -> _Side:
        x = np.arange(rail.y[0], rail.y[-1], RESAMPLING_STEP)
        h = np.interp(x, rail.y, rail.h)
        return cls(wheel.y, wheel.h - pair.radius, x, h, np.gradient(h, x))

    def touch(self, displacement: float, roll: float, larger: float) -> _ContactPoint:
        """Return the contact point at a displacement and a roll that lowers this side; the radius is `larger` [m]."""
        c, s = np.cos(roll), np.sin(roll)
        up = self.below - larger
        y = displacement + c * self.y + s * up
        h = c * up - s * self.y
        begin, end = np.searchsorted(self.x, [max(y[0], self.x[0]), min(y[-1], self.x[-1])])
        x = self.x[begin:end]
        if len(x) < 3:
            return _ContactPoint(np.inf, np.nan, np.nan, np.nan, np.nan, "rail")
        gap = np.interp(x, y, h) - self.rail[begin:end]
        k = int(np.argmin(gap))
        low = gap[k]
        shift = 0.0
        if 0 < k < len(x) - 1:
            bend = gap[k - 1] - 2.0 * gap[k] + gap[k + 1]
            if bend > 0.0:
                shift = 0.5 * (gap[k - 1] - gap[k + 1]) / bend
                low -= 0.125 * (gap[k - 1] - gap[k + 1]) ** 2 / bend
        at = x[k] + shift * RESAMPLING_STEP
        ended = ""
        if at - x[0] < END_MARGIN and begin > 0:  # below its gauge face the rail continues
            ended = "wheel profile"
        elif x[-1] - at < END_MARGIN:
            ended = "rail profile" if end == len(self.x) else "wheel profile"
        body = np.interp(at, y, self.y)
        return _ContactPoint(
            float(low), float(at), float(body), float(np.interp(body, self.y, self.below)),
            float(np.interp(at, self.x, self.slope)), ended,
        )  # fmt: skip


def _solve_roll(
    sides: tuple[_Side, _Side], pair: WheelRailPair, displacement: float, roll: float
) -> tuple[float, _ContactPoint, _ContactPoint]:
    """Return the roll at which both wheels touch, and their contact points."""
    larger = 0.25 * pair.diameter_difference
    low, high = -np.inf, np.inf
    before: tuple[float, float] | None = None
    for _ in range(MAX_ITERATIONS):
        right = sides[0].touch(displacement, roll, larger)
        left = sides[1].touch(-displacement, -roll, -larger)
        difference = right.gap - left.gap
        if not np.isfinite(difference) or abs(difference) < GAP_TOLERANCE:
            break
        # the difference decreases with roll, on treads by the distance between the contacts
        low, high = (roll, high) if difference > 0.0 else (low, roll)
        slope = -(right.rail + left.rail)
        if before is not None and (difference - before[1]) * (roll - before[0]) < 0.0:
            slope = (difference - before[1]) / (roll - before[0])
        before = (roll, difference)
        step = roll - difference / slope
        roll = step if low < step < high else 0.5 * (low + high)
    return roll, right, left


def _check_centre(pair: WheelRailPair, centre: tuple[float, _ContactPoint, _ContactPoint]) -> None:
    """Raise ProfileError if the wheelset does not run on its treads in the middle of the track."""
    for name, point in (("right", centre[1]), ("left", centre[2])):
        location = f"y {(point.rail - 0.5 * pair.gauge) * 1e3:.4g} mm of the rail (from its gauge face)"
        at = f"at gauge {pair.gauge * 1e3:.5g} mm and back to back {pair.back_to_back * 1e3:.5g} mm"
        if not np.isfinite(point.gap) or point.end:
            where = f"beyond the end of a profile ({point.end}, {location})" if np.isfinite(point.gap) else "nowhere"
            raise ProfileError(
                f"no contact {at}: in the middle of the track the {name} wheel touches {where}",
                "check gauge, back to back distance and units, or measure the profiles further out",
            )
        if abs(np.arctan(point.slope)) >= FLANGE_ANGLE:
            raise ProfileError(
                f"no running contact {at}: in the middle of the track the {name} wheel rests on its flange "
                f"({np.degrees(np.arctan(point.slope)):.0f} degrees, {location})",
                "widen the gauge, or check which side of the profiles is the inside",
            )
        if point.wheel - pair.half_distance < FLANGE_TIP:
            raise ProfileError(
                f"the rail lies above the tread {at}: the {name} wheel rests on the tip of its flange, {location}",
                "check the gauge and the heights of both profiles",
            )
