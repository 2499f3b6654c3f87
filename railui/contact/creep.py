"""Creep coefficients of the model from the profiles where they touch, the load and the material."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railui.contact.geometry import ContactGeometry
from railui.contact.hertz import POISSON_STEEL, YOUNG_STEEL, ContactEllipse, hertz
from railui.contact.kalker import VermeulenJohnsonFactors, KalkerCoefficients, vermeulen_johnson_factors, kalker_coefficients


@dataclass(frozen=True)
class CreepCoefficients:
    """Contact of the right wheel at one displacement [m]: curvatures [1/m], ellipse, coefficients of table 3.1.

    longitudinal_creep kappa_x [1], lateral_creep kappa_y [1] and spin_creep kappa_s [m] are Kalker's f11/N, f22/N and
    f23/N times `surface`.
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
        """Slopes of Vermeulen and Johnson's law over Kalker's, along and across: the factors of vermeulen_johnson."""
        return np.pi / (self.factors.phi * self.kalker.c11), np.pi / (self.factors.psi * self.kalker.c22)


def creep_coefficients(
    contacts: ContactGeometry,
    load: float,
    displacement: float = 0.0,
    surface: float = 1.0,
    young: float = YOUNG_STEEL,
    poisson: float = POISSON_STEEL,
) -> CreepCoefficients:
    """Hertz's ellipse and Kalker's coefficients of the right wheel at a displacement [m] under a load [N].

    `surface` is the share of Kalker's coefficients that rails as they are leave (Hobbs 1967: 0.5 to 0.7; 1: clean).
    ValueError where the contact conforms, or is so long or wide that the table has no row for it.
    """
    pair, i = contacts.pair, contacts.index_at(displacement)
    along = float(np.cos(contacts.angle[0, i]) / (pair.radius + contacts.radius[0, i]))
    # heights: hollow is positive, for both; a convex wheel is hollow seen from the rail
    wheel = pair.wheel_curve.curvature(float(contacts.wheel[0, i]))
    rail = -pair.rail_curve.curvature(float(contacts.rail[0, i]))
    ellipse = hertz(load, along, wheel + rail, young, poisson)
    ratio = ellipse.a / ellipse.b
    c = kalker_coefficients(ratio, poisson)
    shear = young / (2.0 * (1.0 + poisson)) * surface
    area = ellipse.a * ellipse.b
    return CreepCoefficients(
        float(contacts.displacement[i]), load, along, wheel, rail, ellipse, c, vermeulen_johnson_factors(ratio, poisson), surface,
        shear * area * c.c11 / load, shear * area * c.c22 / load, shear * area**1.5 * c.c23 / load,
        float(np.sin(contacts.angle[0, i])) / (pair.radius + float(contacts.radius[0, i])),
    )  # fmt: skip
