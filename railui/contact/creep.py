"""Creep coefficients of the model from the profiles at the contact point, the load and the material."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railui.contact.geometry import ContactGeometry
from railui.contact.hertz import POISSON_STEEL, YOUNG_STEEL, ContactEllipse, hertz
from railui.contact.kalker import (
    KalkerCoefficients,
    VermeulenJohnsonFactors,
    kalker_coefficients,
    vermeulen_johnson_factors,
)

REACH = 3.0  # standard deviations of e on either side of the mean, over which coefficients are averaged
NODES = 61  # of that average
MIN_SHARE = 0.5  # of its weight where Hertz's theory holds


@dataclass(frozen=True)
class MeanCreepCoefficients:
    """Creep coefficients of the model, averaged over a motion: kappa_x [1], kappa_y [1], kappa_s [m]."""

    longitudinal_creep: float
    lateral_creep: float
    spin_creep: float


@dataclass(frozen=True)
class CreepCoefficients:
    """Creep coefficients of a wheel at one displacement [m], with curvatures [1/m] and contact ellipse.

    longitudinal_creep kappa_x [1], lateral_creep kappa_y [1] and spin_creep kappa_s [m] are Kalker's f11/N, f22/N and
    f23/N times `surface`; see Broersen 1976, table 3.1.
    """

    displacement: float
    load: float
    along: float
    wheel_across: float
    rail_across: float
    ellipse: ContactEllipse
    kalker: KalkerCoefficients
    factors: VermeulenJohnsonFactors
    surface: float
    longitudinal_creep: float
    lateral_creep: float
    spin_creep: float
    spin: float  # 1/m, of a wheel that rolls without yaw: sin of the contact angle over the radius

    @property
    def vermeulen_johnson(self) -> tuple[float, float]:
        """Slopes of Vermeulen and Johnson's law over Kalker's, longitudinal and lateral."""
        return np.pi / (self.factors.phi * self.kalker.c11), np.pi / (self.factors.psi * self.kalker.c22)


def creep_coefficients(
    contacts: ContactGeometry,
    load: float,
    displacement: float = 0.0,
    surface: float = 1.0,
    young: float = YOUNG_STEEL,
    poisson: float = POISSON_STEEL,
    side: int = 0,
) -> CreepCoefficients:
    """Compute Hertz's ellipse and Kalker's coefficients of one wheel.

    Parameters
    ----------
    contacts : ContactGeometry
        Contact geometry.
    load : float
        Wheel load [N].
    displacement : float
        Lateral displacement of the wheelset [m].
    surface : float
        Share of Kalker's coefficients on contaminated rails (Hobbs 1967: 0.5 to 0.7; 1: clean).
    young, poisson : float
        Young's modulus [N/m^2] and Poisson's ratio.
    side : int
        0 for the right wheel, 1 for the left wheel.

    Raises
    ------
    ValueError
        For conforming contact, and for an ellipse longer or wider than the table of Kalker's coefficients.
    """
    pair, i = contacts.pair, contacts.index_at(displacement)
    along = float(np.cos(contacts.angle[side, i]) / (pair.radius + contacts.radius[side, i]))
    wheel_curve, rail_curve = pair.curves(side)
    # curvatures of heights are positive for concave profiles; a convex wheel is concave as seen from the rail
    wheel = wheel_curve.curvature(float(contacts.wheel[side, i]))
    rail = -rail_curve.curvature(float(contacts.rail[side, i]))
    ellipse = hertz(load, along, wheel + rail, young, poisson)
    ratio = ellipse.a / ellipse.b
    c = kalker_coefficients(ratio, poisson)
    shear = young / (2.0 * (1.0 + poisson)) * surface
    area = ellipse.a * ellipse.b
    return CreepCoefficients(
        float(contacts.displacement[i]), load, along, wheel, rail, ellipse, c,
        vermeulen_johnson_factors(ratio, poisson), surface,
        shear * area * c.c11 / load, shear * area * c.c22 / load, shear * area**1.5 * c.c23 / load,
        float(np.sin(contacts.angle[side, i])) / (pair.radius + float(contacts.radius[side, i])),
    )  # fmt: skip


def mean_creep_coefficients(
    contacts: ContactGeometry, load: float, deviation: float, mean: float = 0.0, surface: float = 1.0, side: int = 0
) -> MeanCreepCoefficients:
    """Average the creep coefficients of one wheel over a normal distribution of e.

    As `linearise`: over a standard deviation [m] about a mean [m], cut where a flange begins to touch. A contact point
    that jumps within the motion then changes them by the share of either point. Displacements at which the contact
    conforms are left out.

    Raises
    ------
    ValueError
        If more than half of the distribution has conforming contact or an ellipse beyond Kalker's table.
    """
    first, last = contacts.tread_range
    offsets = np.linspace(-REACH, REACH, NODES)
    weights, rows, faults = [], [], []
    for offset in offsets[(mean + offsets * deviation >= first) & (mean + offsets * deviation <= last)]:
        weight = float(np.exp(-0.5 * offset**2))
        try:
            found = creep_coefficients(contacts, load, mean + offset * deviation, surface, side=side)
        except ValueError as fault:
            faults.append((weight, fault))
            continue
        weights.append(weight)
        rows.append((found.longitudinal_creep, found.lateral_creep, found.spin_creep))
    without = sum(weight for weight, _ in faults)
    if not weights or without > MIN_SHARE * (sum(weights) + without):
        raise ValueError(str(max(faults, key=lambda each: each[0])[1]) if faults else "no contact on the treads")
    return MeanCreepCoefficients(*np.average(rows, axis=0, weights=weights).tolist())
