"""Rigid contact of a wheelset on its track: where it touches, how it rolls over, at every lateral displacement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.contact.geometry import FLANGE_ANGLE, ContactGeometry
from railui.contact.profile import RESAMPLING_STEP, ProfileError
from railui.contact.wheelset_on_track import ProfileCurve, WheelRailPair

RANGE, STEP = 0.015, 1e-4  # m: displacements looked at
END = 3e-4  # m: a contact this near the end of a profile is none
TURNS = 25
WITHIN = 2e-9  # m of height between both wheels


def find_contacts(pair: WheelRailPair, reach: float = RANGE, step: float = STEP) -> ContactGeometry:
    """Rigid contact with roll at displacements -reach..reach [m]: the wheelset lies on both rails at once.

    ProfileFault where it cannot run on this track at all. Where a contact leaves a profile, the search ends and a note
    says so. Source: thesis 2.2; both wheels' least distance to their rails is brought to the same height by roll.
    """
    wheel, rail = pair.wheel_curve, pair.rail_curve
    side = _Side.of(pair, wheel, rail)
    count = round(reach / step)
    grid = step * np.arange(-count, count + 1)
    spots: dict[int, tuple[float, _Spot, _Spot]] = {}
    notes = []
    centre = _settle(side, pair, 0.0, 0.0)
    _check_centre(pair, centre)
    for direction in (1, -1):
        roll = centre[0]
        for k in range(0, count + 1):
            found = centre if k == 0 else _settle(side, pair, direction * step * k, roll)
            roll = found[0]
            lost = next((n for n, spot in (("right", found[1]), ("left", found[2])) if spot.end), None)
            if lost:
                ends = grid[count + direction * k] * 1e3
                where = found[1].end or found[2].end
                notes.append(f"beyond {ends:.1f} mm the {lost} wheel touches at the end of the {where}")
                break
            spots[count + direction * k] = found
    order = sorted(spots)
    both = [[spots[i][1] for i in order], [spots[i][2] for i in order]]

    def take(name: str) -> FloatArray:
        return np.array([[getattr(spot, name) for spot in row] for row in both])

    delta = 0.25 * pair.diameter_difference
    radius = -take("height") - pair.radius + np.array([[delta], [-delta]])
    return ContactGeometry(
        pair, np.asarray(grid[order], dtype=np.float64), radius, np.arctan(take("slope")), take("wheel"), take("rail"),
        np.array([spots[i][0] for i in order]), tuple(notes),
    )  # fmt: skip


@dataclass(frozen=True)
class _Spot:
    """Where a wheel touches its rail: least distance, points on both, slope, and which profile ends there."""

    gap: float
    rail: float
    wheel: float
    height: float
    slope: float
    end: str


@dataclass(frozen=True, eq=False)
class _Side:
    """One side: points of the wheel in axle co-ordinates, the rail on an even grid."""

    y: FloatArray
    below: FloatArray  # height of the wheel's points less that of the axle
    x: FloatArray
    rail: FloatArray
    slope: FloatArray

    @classmethod
    def of(cls, pair: WheelRailPair, wheel: ProfileCurve, rail: ProfileCurve) -> _Side:
        x = np.arange(rail.y[0], rail.y[-1], RESAMPLING_STEP)
        h = np.interp(x, rail.y, rail.h)
        return cls(wheel.y, wheel.h - pair.radius, x, h, np.gradient(h, x))

    def touch(self, displacement: float, roll: float, larger: float) -> _Spot:
        """Least height of the wheel over the rail; roll lowers this side; the radius is `larger` by so much."""
        c, s = np.cos(roll), np.sin(roll)
        up = self.below - larger
        y = displacement + c * self.y + s * up
        h = c * up - s * self.y
        begin, end = np.searchsorted(self.x, [max(y[0], self.x[0]), min(y[-1], self.x[-1])])
        x = self.x[begin:end]
        if len(x) < 3:
            return _Spot(np.inf, np.nan, np.nan, np.nan, np.nan, "rail")
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
        if at - x[0] < END and begin > 0:  # below its gauge face the rail goes on
            ended = "wheel profile"
        elif x[-1] - at < END:
            ended = "rail profile" if end == len(self.x) else "wheel profile"
        body = np.interp(at, y, self.y)
        return _Spot(
            float(low), float(at), float(body), float(np.interp(body, self.y, self.below)),
            float(np.interp(at, self.x, self.slope)), ended,
        )  # fmt: skip


def _settle(side: _Side, pair: WheelRailPair, displacement: float, roll: float) -> tuple[float, _Spot, _Spot]:
    """Roll at which both wheels touch, and where they do."""
    larger = 0.25 * pair.diameter_difference
    low, high = -np.inf, np.inf
    before: tuple[float, float] | None = None
    for _ in range(TURNS):
        right = side.touch(displacement, roll, larger)
        left = side.touch(-displacement, -roll, -larger)
        difference = right.gap - left.gap
        if not np.isfinite(difference) or abs(difference) < WITHIN:
            break
        # the difference falls with the roll, on treads by the distance of the contacts
        low, high = (roll, high) if difference > 0.0 else (low, roll)
        slope = -(right.rail + left.rail)
        if before is not None and (difference - before[1]) * (roll - before[0]) < 0.0:
            slope = (difference - before[1]) / (roll - before[0])
        before = (roll, difference)
        step = roll - difference / slope
        roll = step if low < step < high else 0.5 * (low + high)
    return roll, right, left


def _check_centre(pair: WheelRailPair, centre: tuple[float, _Spot, _Spot]) -> None:
    """Raises where the wheelset does not run on its treads in the middle of the track."""
    for name, spot in (("right", centre[1]), ("left", centre[2])):
        place = f"y {(spot.rail - 0.5 * pair.gauge) * 1e3:.4g} mm of the rail (from its gauge face)"
        at = f"at gauge {pair.gauge * 1e3:.5g} mm and back to back {pair.back_to_back * 1e3:.5g} mm"
        if not np.isfinite(spot.gap) or spot.end:
            where = f"beyond the end of a profile ({spot.end}, {place})" if np.isfinite(spot.gap) else "nowhere"
            raise ProfileError(
                f"no contact {at}: in the middle of the track the {name} wheel touches {where}",
                "check gauge, back to back distance and units, or measure the profiles further out",
            )
        if abs(np.arctan(spot.slope)) >= FLANGE_ANGLE:
            raise ProfileError(
                f"no running contact {at}: in the middle of the track the {name} wheel stands on its flange "
                f"({np.degrees(np.arctan(spot.slope)):.0f} degrees, {place})",
                "widen the gauge, or check which side of the profiles is the inside",
            )
        if spot.wheel - pair.half_distance < -0.045:
            raise ProfileError(
                f"the rail lies above the tread {at}: the {name} wheel stands on the tip of its flange, {place}",
                "check the gauge and the heights of both profiles",
            )
