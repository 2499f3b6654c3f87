"""Cross profile of a wheel or rail: checked, oriented and smoothed points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import Akima1DInterpolator

from railui.arrays import FloatArray

Kind = Literal["wheel", "rail"]

RESAMPLING_STEP = 5e-5  # m between the points of a resampled profile
MIN_POINTS = 8
MAX_POINTS = 20_000
WIDTH_LIMITS = {
    "wheel": (0.05, 0.25),
    "rail": (0.03, 0.25),
}  # m across: a worn tread to a whole wheel, a head to a foot
GAUSS_ALPHA = float(
    np.sqrt(np.log(2.0) / np.pi)
)  # of the Gaussian filter of ISO 16610-21: 50 % transmission at the cut-off wavelength
INNER_FACE_TO_TAPE_LINE = 0.070  # m from the inner face of a wheel to its tape line (EN 13715)
MAX_HEIGHT = 0.3  # m
MAX_ARC_LENGTH = 2.0  # m, of the polygon through the points
MAX_ROUGHNESS = 3e-6  # m of noise from point to point that disturbs the contact search
MAX_WHEEL_DROP = 8e-3  # m of the outer end of a wheel below its tread
MIN_POINT_DISTANCE = 1e-9  # m, of two distinct points
MIN_SMOOTHING = 4 * RESAMPLING_STEP
MAX_SMOOTHING = 0.03  # m
MIN_ROUGHNESS_POINTS = 30


class ProfileError(ValueError):
    """Fault of a profile with its remedy and, if it has one, the number of the faulty point, counted from 0."""

    def __init__(self, message: str, remedy: str, point: int | None = None) -> None:
        super().__init__(f"{message}, {remedy}" if remedy else message)
        self.message, self.remedy, self.point = message, remedy, point


@dataclass(frozen=True, eq=False)
class Profile:
    """Right-hand profile from the inside to the outside: y outward, h upward [m], shape [n].

    y of a wheel counts from the tape line (the nominal rolling circle), h from the tread there; those of a rail from
    any origin, since the rail is positioned by its gauge point and its top. `notes`: changes of orientation and origin.

    >>> cone = Profile.from_points("wheel", [-0.04, -0.03, -0.02, 0, 0.02, 0.04, 0.05, 0.06],
    ...                   [-0.03, -0.02, 0, 0.0, 0.001, 0.002, 0.0025, 0.003])
    >>> cone.kind, len(cone.y)
    ('wheel', 8)
    """

    kind: Kind
    y: FloatArray
    h: FloatArray
    name: str = ""
    notes: tuple[str, ...] = ()

    @classmethod
    def from_points(cls, kind: Kind, y: ArrayLike, h: ArrayLike, name: str = "") -> Profile:
        """Return a profile from points in either order and orientation; raise ProfileError for a faulty one.

        A wheel is oriented with its flange inside and below, a rail with its head above; y of a rail must point
        outward, since its sides may be alike.
        """
        across, up = np.array(y, dtype=float), np.array(h, dtype=float)
        _check_points(kind, across, up)
        _check_extent(kind, across, up)
        is_distinct = np.concatenate([[True], np.hypot(np.diff(across), np.diff(up)) > MIN_POINT_DISTANCE])
        points = np.flatnonzero(is_distinct)
        across, up = across[is_distinct], up[is_distinct]
        _check_crossings(across, up, points)
        notes = []
        if _upside_down(kind, across, up):
            up = -up
            notes.append("z points down: turned over")
        if kind == "wheel" and across[np.argmin(up)] > 0.5 * (across.min() + across.max()):
            across = -across
            notes.append("y points to the flange: mirrored")
        if across[0] > across[-1]:
            across, up = across[::-1], up[::-1]
        _check_kind(kind, across, up)
        if kind == "wheel":
            across, up, origin_notes = _from_tape_line(across, up)
            notes += origin_notes
        return cls(kind, np.ascontiguousarray(across), np.ascontiguousarray(up), name, tuple(notes))

    def mirrored(self) -> Profile:
        """Return the profile with inside and outside exchanged, for a rail with y pointing inward."""
        return replace(self, y=-self.y[::-1], h=self.h[::-1], notes=(*self.notes, "mirrored"))

    def rotated(self, angle: float) -> Profile:
        """Return the profile rotated inward by an angle [rad], the inclination of a rail."""
        c, s = np.cos(angle), np.sin(angle)
        return replace(self, y=c * self.y - s * self.h, h=s * self.y + c * self.h)

    def smoothed(self, wavelength: float) -> Profile:
        """Return the profile after a low-pass with a cut-off wavelength [m] (50 % transmission).

        Gaussian filter of ISO 16610-21 over the arc length; beyond the ends the profile continues by its point
        reflection.
        """
        if not MIN_SMOOTHING <= wavelength <= MAX_SMOOTHING:
            raise ProfileError(
                f"a smoothing wavelength of {wavelength * 1e3:g} mm is out of range", "take 0.2 to 30 mm, such as 4 mm"
            )
        s, y, h = self.resampled()
        step = s[1] - s[0]
        reach = int(np.ceil(GAUSS_ALPHA * wavelength * 3.0 / step))
        x = step * np.arange(-reach, reach + 1) / (GAUSS_ALPHA * wavelength)
        weight = np.exp(-np.pi * x * x)
        weight /= weight.sum()
        if len(s) <= reach + 1:
            raise ProfileError(f"the profile is shorter than a smoothing of {wavelength * 1e3:g} mm", "smooth less")
        smooth = []
        for z in (y, h):
            wide = np.concatenate([2 * z[0] - z[reach:0:-1], z, 2 * z[-1] - z[-2 : -reach - 2 : -1]])
            smooth.append(np.convolve(wide, weight, "valid"))
        note = f"smoothed at {wavelength * 1e3:g} mm (Gaussian, half left)"
        return replace(self, y=smooth[0], h=smooth[1], notes=(*self.notes, note))

    def resampled(self, step: float = RESAMPLING_STEP) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return arc length, y and h [m] at points about `step` [m] apart, interpolated by Akima's curve."""
        s = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(self.y), np.diff(self.h)))])
        fine = np.linspace(0.0, s[-1], max(int(s[-1] / step) + 1, 2))
        y, h = (Akima1DInterpolator(s, z, method="makima")(fine) for z in (self.y, self.h))
        return fine, y, h

    def roughness(self) -> float:
        """Return the standard deviation of the noise from point to point [m], estimated from third differences of h."""
        if len(self.y) < MIN_ROUGHNESS_POINTS:
            return 0.0
        third = np.diff(self.h, 3)
        middle = third[len(third) // 8 : -len(third) // 8]
        # third differences of white noise have the variance 1 + 9 + 9 + 1; the median ignores corners
        return float(np.median(np.abs(middle)) / 0.6745 / np.sqrt(20.0))


def _check_points(kind: Kind, y: FloatArray, h: FloatArray) -> None:
    """Raise ProfileError for too few or too many points, values that are not finite and an implausible width."""
    if len(y) != len(h) or len(y) < MIN_POINTS:
        raise ProfileError(f"the profile has {len(y)} points", f"give {MIN_POINTS} or more")
    if len(y) > MAX_POINTS:
        raise ProfileError(f"the profile has {len(y)} points", f"give {MAX_POINTS} at most, one every 0.02 mm")
    bad = np.flatnonzero(~(np.isfinite(y) & np.isfinite(h)))
    if len(bad):
        raise ProfileError("a point is not finite", "give numbers", int(bad[0]))
    low, high = WIDTH_LIMITS[kind]
    span = float(np.ptp(y))
    if not low <= span <= high:
        size = f"{span:.4g} m" if span > 1 else f"{span * 1e3:.4g} mm"
        short = "too short, or" if 0.1 * low < span < low else "probably"
        raise ProfileError(
            f"the {kind} profile is {size} wide: {short} in another unit",
            f"a {kind} is {low * 1e3:g} to {high * 1e3:g} mm wide: give the unit in the header, `y [mm], z [mm]`",
        )


def _check_crossings(y: FloatArray, h: FloatArray, points: NDArray[np.intp]) -> None:
    """Raise ProfileError with the location at which the line through the points crosses itself."""
    p = np.stack([y, h], axis=1)
    a, d = p[:-1], np.diff(p, axis=0)
    for i in range(len(d) - 2):
        b, e = a[i + 2 :], d[i + 2 :]
        det = d[i, 0] * e[:, 1] - d[i, 1] * e[:, 0]
        gap = b - a[i]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (gap[:, 0] * e[:, 1] - gap[:, 1] * e[:, 0]) / det
            u = (gap[:, 0] * d[i, 1] - gap[:, 1] * d[i, 0]) / det
        hit = np.flatnonzero((t > 1e-9) & (t < 1 - 1e-9) & (u > 1e-9) & (u < 1 - 1e-9))
        if len(hit):
            j = i + 2 + int(hit[0])
            x, z = p[i] + t[hit[0]] * d[i]
            raise ProfileError(
                f"the profile crosses itself at y {x * 1e3:.3f} mm, z {z * 1e3:.3f} mm, between points "
                f"{points[i] + 1} and {points[i] + 2} and between {points[j] + 1} and {points[j] + 2}",
                "order the points along the profile and leave out those measured twice",
                int(points[j]),
            )


def _upside_down(kind: Kind, y: FloatArray, h: FloatArray) -> bool:
    """Return True if h points down: a flange and the sides of a rail head reach far below the running surface."""
    first, last = (float(end) for end in np.quantile(y, [0.02, 0.98]))
    middle = float(np.median(np.interp(np.linspace(first, last, 200), *_sorted(y, h))))
    return bool(h.max() - middle > middle - h.min())


def _check_extent(kind: Kind, y: FloatArray, h: FloatArray) -> None:
    """Raise ProfileError for a profile higher or longer than any, which would take unlimited memory."""
    height = float(np.ptp(h))
    if height > MAX_HEIGHT:
        lowest = int(np.argmax(np.abs(h - np.median(h))))
        fault = f"the {kind} profile is {height * 1e3:.4g} mm high, more than the {MAX_HEIGHT * 1e3:g} mm of any"
        raise ProfileError(fault, "correct the number, or its unit", lowest)
    length = float(np.sum(np.hypot(np.diff(y), np.diff(h))))
    if length > MAX_ARC_LENGTH:
        fault = f"the {kind} profile is {length:.4g} m long from point to point: its points go back and forth"
        raise ProfileError(fault, "sort the points along the profile, or smooth them")


def _check_kind(kind: Kind, y: FloatArray, h: FloatArray) -> None:
    """Raise ProfileError for a rail, whose head falls off to both sides, given as a wheel, and the reverse."""
    outer = y > y[0] + 0.8 * (y[-1] - y[0])
    falls = float(h.max() - h[outer].min())
    if kind == "wheel" and falls > MAX_WHEEL_DROP:
        fault = f"the wheel profile falls by {falls * 1e3:.3g} mm to its outer end: that is a rail"
        raise ProfileError(fault, "give the wheel first, then the rail")
    if kind == "rail" and outer[np.argmax(h)] and h.max() - h[0] > MAX_WHEEL_DROP and falls < 0.5 * MAX_WHEEL_DROP:
        raise ProfileError(
            "the rail profile is highest at its outer end: that is a wheel, or a rail whose y points to the gauge side",
            "give the wheel first, then the rail; mirror a rail whose y points to the gauge side",
        )


def _sorted(y: FloatArray, h: FloatArray) -> tuple[FloatArray, FloatArray]:
    order = np.argsort(y, kind="stable")
    return y[order], h[order]


def _from_tape_line(y: FloatArray, h: FloatArray) -> tuple[FloatArray, FloatArray, list[str]]:
    """Return a wheel with y and h from the tape line; y from the inner face is shifted by 70 mm."""
    notes = []
    if y[0] > -0.02:
        y = y - INNER_FACE_TO_TAPE_LINE
        notes.append("y counts from the inner face: tape line at 70 mm")
    if not y[0] < 0.0 < y[-1]:
        raise ProfileError(
            f"the wheel profile reaches from y {y[0] * 1e3:.4g} to {y[-1] * 1e3:.4g} mm: the tape line is not in it",
            "count y from the tape line or from the inner face of the wheel",
        )
    tip = int(np.argmin(h))
    level = float(np.interp(0.0, y[tip:], np.maximum.accumulate(h[tip:]) if tip else h))
    return y, h - level, notes
