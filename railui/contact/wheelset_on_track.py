"""Position of wheel and rail profiles: two wheels on their axle, two rails at their gauge."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from railui.arrays import FloatArray
from railui.contact.profile import INNER_FACE_TO_TAPE_LINE, RESAMPLING_STEP, Profile, ProfileError

GAUGE_DEPTH = 0.014  # m below the rail top within which the gauge is measured (EN 13848-1)
MIN_CLEARANCE = 0.02  # m, gauge less back-to-back distance
MAX_CLEARANCE = 0.3  # m
MAX_BACKWARD = 1e-3  # m by which a profile may turn back, as noise
MIN_CURVATURE_POINTS = 5


@dataclass(frozen=True, eq=False)
class ProfileCurve:
    """Profile as a function: h at increasing y [m], shape [n]."""

    y: FloatArray
    h: FloatArray

    def curvature(self, at: float, width: float = 2e-3) -> float:
        """Return the curvature at a point [1/m], of a parabola over `width` [m]; concave positive."""
        near = np.abs(self.y - at) <= 0.5 * width
        if near.sum() < MIN_CURVATURE_POINTS:
            return float("nan")
        x = self.y[near] - at
        c2, c1, _ = np.polyfit(x, self.h[near], 2)
        return float(2.0 * c2 / (1.0 + c1 * c1) ** 1.5)


@dataclass(frozen=True, eq=False)
class WheelRailPair:
    """Profiles of both wheels and rails, and their position.

    Attributes
    ----------
    wheel, rail : Profile
        Profiles of the right-hand side, and of the left-hand side unless that has its own.
    gauge : float
        Distance between the rails [m], measured up to `below` [m] under the rail top.
    back_to_back : float
        Distance between the inner faces of the wheels [m].
    inclination : float
        Angle [rad] by which the rail profile is rotated inward.
    radius : float
        Mean rolling radius at the tape line [m].
    diameter_difference : float
        Diameter of the right wheel less that of the left wheel [m].
    left_wheel, left_rail : Profile, optional
        Profiles of the left-hand side, y outward like those of the right-hand side.

    Raises
    ------
    ProfileError
        If profiles or dimensions do not fit.
    """

    wheel: Profile
    rail: Profile
    gauge: float = 1.435
    back_to_back: float = 1.360
    inclination: float = 0.0
    radius: float = 0.46
    diameter_difference: float = 0.0
    below: float = GAUGE_DEPTH
    left_wheel: Profile | None = None
    left_rail: Profile | None = None

    def __post_init__(self) -> None:
        for wheel, rail in ((self.wheel, self.rail), (self.left_wheel or self.wheel, self.left_rail or self.rail)):
            if wheel.kind != "wheel" or rail.kind != "rail":
                raise ProfileError(
                    f"the first profile is of a {wheel.kind}, the second of a {rail.kind}",
                    "give the wheel first, then the rail",
                )
        clearance = self.gauge - self.back_to_back
        if not MIN_CLEARANCE < clearance < MAX_CLEARANCE:
            raise ProfileError(
                f"the gauge {self.gauge * 1e3:.4g} mm leaves {clearance * 1e3:.4g} mm to the back to back distance "
                f"{self.back_to_back * 1e3:.4g} mm",
                "give both in one unit, such as --gauge '1435 mm' --back-to-back '1360 mm'",
            )

    @cached_property
    def half_distance(self) -> float:
        """Half the distance between the tape lines [m]: b of the model."""
        return 0.5 * self.back_to_back + INNER_FACE_TO_TAPE_LINE

    @property
    def has_equal_sides(self) -> bool:
        """True if the profiles of the left-hand side are those of the right-hand side."""
        return self.left_wheel is None and self.left_rail is None

    @property
    def profiles(self) -> tuple[tuple[str, Profile], ...]:
        """Distinct profiles with their names: wheel and rail, and those of the left-hand side."""
        named = (
            *(("wheel", self.wheel), ("rail", self.rail)),
            *(("left wheel", self.left_wheel), ("left rail", self.left_rail)),
        )
        return tuple((name, profile) for name, profile in named if profile is not None)

    @cached_property
    def wheel_curve(self) -> ProfileCurve:
        """Right wheel from the tip of its flange outward: y from the track centre line, h from the tape line."""
        return self._wheel_curve(self.wheel)

    @cached_property
    def rail_curve(self) -> ProfileCurve:
        """Right rail from its gauge face outward: y from the track centre line, h from its top."""
        return self._rail_curve(self.rail)

    @cached_property
    def left_wheel_curve(self) -> ProfileCurve:
        """Left wheel like `wheel_curve`, y to the left."""
        return self.wheel_curve if self.left_wheel is None else self._wheel_curve(self.left_wheel)

    @cached_property
    def left_rail_curve(self) -> ProfileCurve:
        """Left rail like `rail_curve`, y to the left."""
        return self.rail_curve if self.left_rail is None else self._rail_curve(self.left_rail)

    def curves(self, side: int) -> tuple[ProfileCurve, ProfileCurve]:
        """Return wheel and rail of a side: 0 right, 1 left."""
        return (self.left_wheel_curve, self.left_rail_curve) if side else (self.wheel_curve, self.rail_curve)

    def _wheel_curve(self, wheel: Profile) -> ProfileCurve:
        _, y, h = wheel.resampled()
        tip = int(np.argmin(h))
        curve = _increasing(y[tip:], h[tip:], wheel)
        return ProfileCurve(curve.y + self.half_distance, curve.h)

    def _rail_curve(self, rail: Profile) -> ProfileCurve:
        _, y, h = rail.rotated(self.inclination).resampled()
        top = float(h.max())
        inside = np.flatnonzero(h >= top - self.below)
        crown = int(np.argmax(h))
        begin = crown
        while begin > 0 and h[begin - 1] >= top - self.below:
            begin -= 1
        if begin == 0 and h[0] > top - self.below + 1e-4 and h[0] - top > -0.9 * self.below:
            raise ProfileError(
                f"the rail profile ends {(top - h[0]) * 1e3:.3g} mm below its top on the gauge side (y "
                f"{y[0] * 1e3:.4g} mm), the gauge is measured {self.below * 1e3:g} mm below it",
                "measure the gauge face too, or mirror the profile if this is its outer side",
            )
        face = float(y[inside[inside >= begin]].min())
        start = int(begin + np.argmin(y[begin : crown + 1]))
        end = crown + int(np.argmax(y[crown:]))
        curve = _increasing(y[start : end + 1], h[start : end + 1], rail)
        return ProfileCurve(curve.y - face + 0.5 * self.gauge, curve.h - top)


def _increasing(y: FloatArray, h: FloatArray, profile: Profile) -> ProfileCurve:
    """Return the points with increasing y; raise ProfileError for a profile that turns back by more than noise."""
    reached = np.maximum.accumulate(y)
    back = reached - y
    if back.max() > MAX_BACKWARD:
        at = int(np.argmax(back))
        raise ProfileError(
            f"the {profile.kind} profile turns back by {back.max() * 1e3:.3g} mm at y {y[at] * 1e3:.4g} mm, "
            f"z {h[at] * 1e3:.4g} mm",
            "leave out points that are not on its running surface",
        )
    is_increasing = np.concatenate([[True], y[1:] > reached[:-1] + 0.02 * RESAMPLING_STEP])
    return ProfileCurve(y[is_increasing], h[is_increasing])
