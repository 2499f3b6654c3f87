"""A wheelset over its track: two wheels on their axle, two rails at their gauge."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from railui.arrays import FloatArray
from railui.contact.profile import RESAMPLING_STEP, INNER_FACE_TO_TAPE_LINE, Profile, ProfileError

BELOW = 0.014  # m below the rail top within which the gauge is measured (EN 13848-1)


@dataclass(frozen=True, eq=False)
class ProfileCurve:
    """A profile as a function: h at points y that rise [m], shape [n]."""

    y: FloatArray
    h: FloatArray

    def curvature(self, at: float, width: float = 2e-3) -> float:
        """Second derivative over (1 + slope^2)^1.5 at a point [1/m], by a parabola over `width`; hollow positive."""
        near = np.abs(self.y - at) <= 0.5 * width
        if near.sum() < 5:
            return float("nan")
        x = self.y[near] - at
        c2, c1, _ = np.polyfit(x, self.h[near], 2)
        return float(2.0 * c2 / (1.0 + c1 * c1) ** 1.5)


@dataclass(frozen=True, eq=False)
class WheelRailPair:
    """Profiles of the right-hand side and how they stand (both sides alike, but for the diameters). SI.

    gauge: distance of the rails, measured `below` the rail top; back_to_back: distance of the wheels' inner faces;
    inclination [rad] by which the rail profile is to be turned inwards; radius: mean rolling radius at the tape line;
    diameter_difference: diameter of the right wheel less that of the left one. ProfileFault where they do not fit.
    """

    wheel: Profile
    rail: Profile
    gauge: float = 1.435
    back_to_back: float = 1.360
    inclination: float = 0.0
    radius: float = 0.46
    diameter_difference: float = 0.0
    below: float = BELOW

    def __post_init__(self) -> None:
        if self.wheel.kind != "wheel" or self.rail.kind != "rail":
            raise ProfileError(
                f"a {self.wheel.kind} profile stands where the wheel belongs, a {self.rail.kind} where the rail does",
                "give the wheel first, then the rail",
            )
        room = self.gauge - self.back_to_back
        if not 0.02 < room < 0.3:
            raise ProfileError(
                f"the gauge {self.gauge * 1e3:.4g} mm leaves {room * 1e3:.4g} mm to the back to back distance "
                f"{self.back_to_back * 1e3:.4g} mm",
                "give both in one unit, such as --gauge '1435 mm' --back-to-back '1360 mm'",
            )

    @cached_property
    def half_distance(self) -> float:
        """Half the distance of the tape lines [m]: b of the model."""
        return 0.5 * self.back_to_back + INNER_FACE_TO_TAPE_LINE

    @cached_property
    def wheel_curve(self) -> ProfileCurve:
        """The right wheel from the tip of its flange outwards: y from the track's middle, h from the tape line."""
        _, y, h = self.wheel.resampled()
        tip = int(np.argmin(h))
        curve = _rising(y[tip:], h[tip:], self.wheel)
        return ProfileCurve(curve.y + self.half_distance, curve.h)

    @cached_property
    def rail_curve(self) -> ProfileCurve:
        """The right rail from its gauge face outwards: y from the track's middle, h from its top."""
        _, y, h = self.rail.rotated(self.inclination).resampled()
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
        curve = _rising(y[start : end + 1], h[start : end + 1], self.rail)
        return ProfileCurve(curve.y - face + 0.5 * self.gauge, curve.h - top)


def _rising(y: FloatArray, h: FloatArray, profile: Profile) -> ProfileCurve:
    """The points whose y rises; a profile that goes back by more than noise has no single height."""
    reached = np.maximum.accumulate(y)
    back = reached - y
    if back.max() > 1e-3:
        at = int(np.argmax(back))
        raise ProfileError(
            f"the {profile.kind} profile turns back by {back.max() * 1e3:.3g} mm at y {y[at] * 1e3:.4g} mm, "
            f"z {h[at] * 1e3:.4g} mm",
            "leave out points that are not on its running surface",
        )
    kept = np.concatenate([[True], y[1:] > reached[:-1] + 0.02 * RESAMPLING_STEP])
    return ProfileCurve(y[kept], h[kept])
