"""Smooth curves of contact geometry, which replace e in the linear contact geometry of the kernel."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from railui.arrays import FloatArray
from railui.contact.contact_points import find_contacts
from railui.contact.geometry import ContactGeometry
from railui.contact.linearisation import LinearContact, linearise
from railui.contact.wheelset_on_track import WheelRailPair

KNOT_SPACING = 2.5e-4  # m
SMOOTHING_SD = 2e-4  # m, of the Gaussian that smooths jumps: a contact patch is some mm wide
GAUGE_STEP = 1e-3  # m to either side, for the derivative with respect to the gauge
MAX_DISPLACEMENT = 0.012  # m
MIN_CONICITY = 1e-4
MIN_GRAVITATIONAL_STIFFNESS = 1e-3
MIN_INTERVALS = 8


@dataclass(frozen=True, eq=False)
class ProfileShape:
    """Curves over equally spaced displacements [m], all of one length (the effect profile_shape).

    (r_1 - r_2)/2 = lambda (radius + radius_per_gauge g), tan gamma_1 - tan gamma_2 = 2 epsilon angle/b.
    """

    displacement: FloatArray
    radius: FloatArray
    radius_per_gauge: FloatArray
    angle: FloatArray

    def parameters(self) -> dict[str, tuple[float, ...]]:
        """Return the parameters of the effect profile_shape."""
        return {key: tuple(float(f"{x:.9g}") for x in getattr(self, key)) for key in self.__dataclass_fields__}


def compute_profile_shape(contacts: ContactGeometry, linear: LinearContact) -> ProfileShape:
    """Compute the curves of a pair over the clearance between its flanges, as multiples of lambda and epsilon.

    They end where a flange begins to touch: beyond, they continue straight and the effect flange_contact acts. Raises
    ValueError for a pair without conicity or gravitational stiffness.
    """
    if not (linear.conicity > MIN_CONICITY and linear.gravitational_stiffness > MIN_GRAVITATIONAL_STIFFNESS):
        raise ValueError(
            f"the profiles have the conicity {linear.conicity:.3g} and the gravitational stiffness "
            f"{linear.gravitational_stiffness:.3g} over a standard deviation of {linear.motion * 1e3:.3g} mm: "
            "no multiple of these is the shape of the profiles"
        )
    first, last = (float(np.clip(end, -MAX_DISPLACEMENT, MAX_DISPLACEMENT)) for end in contacts.tread_range)
    count = max(int((last - first) / KNOT_SPACING), MIN_INTERVALS)
    grid = np.linspace(first, last, count + 1)
    b = contacts.pair.half_distance
    half, tilt = _curves(contacts, grid)
    narrow, wide = (_curves(_at_gauge(contacts.pair, sign * GAUGE_STEP), grid)[0] for sign in (-1, 1))
    per_gauge = (wide - narrow) / (2.0 * GAUGE_STEP)
    radius = half / linear.conicity
    return ProfileShape(grid, radius, per_gauge / linear.conicity, b * tilt / linear.gravitational_stiffness)


def conicity_per_gauge(pair: WheelRailPair, deviation: float) -> float:
    """Return d lambda/dg [1/m], lambda linearised over a standard deviation [m] (Broersen 1976, 5.5)."""
    narrow, wide = (linearise(_at_gauge(pair, s * GAUGE_STEP), deviation).conicity for s in (-1, 1))
    return (wide - narrow) / (2.0 * GAUGE_STEP)


def _at_gauge(pair: WheelRailPair, wider: float) -> ContactGeometry:
    return find_contacts(replace(pair, gauge=pair.gauge + wider))


def _curves(contacts: ContactGeometry, grid: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (r_1 - r_2)/2 and (tan gamma_1 - tan gamma_2)/2 at displacements, smoothed and limited to 45 degrees."""
    e = contacts.displacement
    steep = np.clip(np.tan(contacts.angle), -1.0, 1.0)
    inside = np.clip(e, *contacts.tread_range)
    out = []
    for curve in (0.5 * contacts.delta_r, 0.5 * (steep[0] - steep[1])):
        clipped = np.interp(inside, e, curve)
        # smoothed as a deviation from a straight line, so that the ends keep their values
        line = np.polyval(np.polyfit(e, clipped, 1), e)
        weight = np.exp(-0.5 * ((grid[:, None] - e[None, :]) / SMOOTHING_SD) ** 2)
        weight /= weight.sum(axis=1, keepdims=True)
        out.append(weight @ (clipped - line) + np.interp(grid, e, line))
    return out[0], out[1]
