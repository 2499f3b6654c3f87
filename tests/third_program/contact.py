"""Forces of the rails on a wheelset as a function of its motion: linear geometry, creep, saturation and flange.

The law of docs/theory.md, wheel by wheel. It is all of the vehicle that Exudyn has no object for.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot


@dataclass(frozen=True)
class Rails:
    """Track under a wheelset at one time: lateral deviation [m], cross-level [rad], their rates, speed [m/s]."""

    y: float
    vy: float
    phi: float
    vphi: float
    speed: float


@dataclass(frozen=True)
class Wheels:
    """Numbers of the contact of a wheelset, SI; friction and clearance None: neither saturation nor flange."""

    half_gauge: float
    radius: float
    load: float
    spin_inertia: float
    conicity: float
    longitudinal_creep: float
    lateral_creep: float
    spin_creep: float
    gravitational_stiffness: float
    contact_angle: float
    roll: float
    friction: float | None = None
    clearance: float | None = None
    flange: float = 0.0

    def forced_roll(self, rails: Rails) -> tuple[float, float]:
        """Roll of a wheelset at y = 0 and its rate, (3.8): phi = phi_w - sigma e/b."""
        ratio = self.roll / self.half_gauge
        return (
            (1 + ratio * self.radius) * rails.phi + ratio * rails.y,
            (1 + ratio * self.radius) * rails.vphi + ratio * rails.vy,
        )

    def forces(self, rails: Rails, y: float, vy: float, psi: float, vpsi: float) -> tuple[float, float]:
        """Lateral force [N] and yaw moment [N*m] on a wheelset at y, psi."""
        b, r, N, V = self.half_gauge, self.radius, self.load, rails.speed
        e, ve = y - rails.y - r * rails.phi, vy - rails.vy - r * rails.vphi
        phi, vphi = rails.phi - self.roll * e / b, rails.vphi - self.roll * ve / b
        lateral = yaw = 0.0
        for side in (1.0, -1.0):  # right, left
            rolling = r + side * self.conicity * e
            angle = self.contact_angle + side * (self.gravitational_stiffness * e / b - rails.phi)
            along = (r - rolling) / r - side * b * vpsi / V
            across = (vy - r * vphi) / V - psi
            spin = (-side * angle - phi) / r + vpsi / V
            T_x = self.longitudinal_creep * N * along
            T_y = self.lateral_creep * N * across + self.spin_creep * N * spin
            if self.friction is not None:
                factor = _saturation(hypot(T_x, T_y) / (self.friction * N))
                T_x, T_y = factor * T_x, factor * T_y
            guiding = side * N * angle + T_y
            lateral -= guiding
            yaw += side * b * (T_x + psi * guiding)
        if self.clearance is not None:
            lateral -= self.flange * (e - min(max(e, -self.clearance), self.clearance))
        return lateral, yaw


def _saturation(q: float) -> float:
    """Factor of Vermeulen and Johnson (1964) on both creep forces."""
    return 1 - q / 3 + q * q / 27 if q < 3 else 1 / q
