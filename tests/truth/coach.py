"""A whole coach on two bogies by Newton and Euler: forces at points, moments about centres, plain numpy.

Seventeen degrees of freedom: lateral, yaw, roll of body and two frames, lateral and yaw of four wheelsets. Axes x
forward, y right, z down; heights h upwards. Every suspension force is computed from the motion of its two ends, applied
to both bodies at its point, and taken to the centres of mass. Wheel by wheel the contact is (3.2)-(3.5) of Broersen
(1976). A wheelset leans as the rails and its own displacement make it; its roll moment goes to the rails, but for what
the lean per lateral displacement hands back. The numbers are those of the Manchester benchmark, vehicle 1.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

V_PLACES = 17
BODY, FRAMES, WHEELSETS = 0, (3, 6), (9, 11, 13, 15)  # where the co-ordinates of each begin


@dataclass(frozen=True)
class Coach:
    """Numbers of the coach, SI; triples are longitudinal, lateral, vertical, of each box or side."""

    m: float = 32000.0
    I_z: float = 1.97e6
    I_x: float = 56.8e3
    h: float = 1.8
    a_c: float = 9.5
    m_f: float = 2615.0
    I_zf: float = 3067.0
    I_xf: float = 1722.0
    h_f: float = 0.6
    a: float = 1.28
    m_w: float = 1813.0
    I_zw: float = 1120.0
    I_yw: float = 112.0
    b: float = 0.75
    r: float = 0.46
    N: float = 54.546e3
    primary: tuple[float, float, float] = (31.391e6, 3.884e6, 1.22e6)
    primary_c: tuple[float, float, float] = (0.0, 0.0, 4e3)
    primary_y: float = 1.0
    primary_load: float = 45.65e3
    secondary: tuple[float, float, float] = (0.16e6, 0.16e6, 0.43e6)
    secondary_c: tuple[float, float, float] = (0.0, 32e3, 20e3)
    secondary_y: float = 1.0
    secondary_h: float = 0.8275
    secondary_load: float = 78.48e3
    bending: float = 10.5e3
    anti_roll: float = 940e3
    stop: tuple[float, float] = (0.025, 1e6)
    lam: float = 0.1
    kappa_x: float = 140.0
    kappa_y: float = 125.0
    kappa_s: float = 0.25
    epsilon: float = 6.0
    delta: float = 0.05
    sigma: float = 0.05
    friction: float = 0.35
    clearance: float = 7e-3
    flange: float = 14.6e6


@dataclass
class Solid:
    """One body: where its centre is, how it moves, and what acts on it (lateral force, yaw and roll moment)."""

    x: float
    h: float
    q: Floats  # lateral, yaw, roll
    v: Floats
    force: Floats = field(default_factory=lambda: np.zeros(3))

    def end(self, x: float, y: float, h: float) -> tuple[Floats, Floats]:
        """Displacement and velocity (x, y, z) of a point of it."""
        arm = np.array([x - self.x, y, -(h - self.h)])
        turn, spin = np.array([self.q[2], 0.0, self.q[1]]), np.array([self.v[2], 0.0, self.v[1]])
        return np.array([0, self.q[0], 0]) + np.cross(turn, arm), np.array([0, self.v[0], 0]) + np.cross(spin, arm)

    def push(self, F: Floats, x: float, y: float, h: float) -> None:
        """A force (x, y, z) at a point of it."""
        moment = np.cross(np.array([x - self.x, y, -(h - self.h)]), F)
        self.force += np.array([F[1], moment[2], moment[0]])


def spring(
    lower: Solid, upper: Solid, x: float, y: float, h: float, k: tuple[float, float, float],
    c: tuple[float, float, float], load: float,
) -> None:  # fmt: skip
    """A spring and damper between the same point of two bodies, which carries a weight."""
    (u_l, v_l), (u_u, v_u) = lower.end(x, y, h), upper.end(x, y, h)
    F = -np.array(k) * (u_u - u_l) - np.array(c) * (v_u - v_l)  # on the upper one
    upper.push(F, x, y, h)
    lower.push(-F, x, y, h)
    # the weight is carried along the mean lean; its points of attack turn with the bodies, and lie apart
    lean, apart = (lower.q[2] + upper.q[2]) / 2, u_u[1] - u_l[1]
    for body, sign in ((upper, 1.0), (lower, -1.0)):
        d = h - body.h
        F_y, F_z = sign * load * lean, -sign * load
        body.force[0] += F_y
        body.force[1] += (x - body.x) * F_y
        body.force[2] += d * body.q[2] * F_z + d * F_y + load * apart / 2


def wheelset_forces(c: Coach, solid: Solid, V: float, rail: Floats, full: bool) -> tuple[float, float]:
    """Q_y and Q_psi with the gyroscopic moments; rail: y_w, dy_w/ds, phi_w, dphi_w/ds."""
    y, psi, vy, vpsi = solid.q[0], solid.q[1], solid.v[0], solid.v[1]
    y_w, dy_w, phi_w, dphi_w = rail
    e = y - y_w - c.r * phi_w
    # phi' from a lean that takes y' - y_w' for e' (3.9)
    phi, dphi = phi_w - c.sigma * e / c.b, V * dphi_w - c.sigma * (vy - V * dy_w - c.r * V * dphi_w) / c.b
    T, Y = [], []
    for j in (1, 2):
        side = (-1) ** j
        r_j = c.r - side * c.lam * e
        gamma = c.delta - side * (-phi_w + c.epsilon * e / c.b)
        u_x = (c.r - r_j) / c.r + side * c.b * vpsi / V
        u_y = vy / V - c.r * dphi / V - psi
        u_n = (side * gamma - phi) / c.r + vpsi / V
        T_x, T_y = c.kappa_x * c.N * u_x, c.kappa_y * c.N * u_y + c.kappa_s * c.N * u_n
        if full:
            q = np.hypot(T_x, T_y) / (c.friction * c.N)
            factor = 1 - q / 3 + q**2 / 27 if q < 3 else 1 / q
            T_x, T_y = factor * T_x, factor * T_y
        T.append(T_x)
        Y.append(-side * c.N * gamma + T_y)
    flange = c.flange * (e - np.clip(e, -c.clearance, c.clearance)) if full else 0.0
    G = c.I_yw * V * c.sigma / (c.b * c.r)
    return -Y[0] - Y[1] - flange + G * vpsi, c.b * (T[0] - T[1]) + c.b * psi * (Y[0] - Y[1]) - G * vy


def rate(c: Coach, x: Floats, V: float, rails: Floats, full: bool = True) -> Floats:
    """x' of x = [q, q'] over rails [4, 4]."""
    q, v = x[:V_PLACES], x[V_PLACES:]
    body = Solid(0.0, c.h, q[0:3], v[0:3])
    frames = [Solid(s * c.a_c, c.h_f, q[i : i + 3], v[i : i + 3]) for s, i in zip((1, -1), FRAMES, strict=True)]
    acceleration = np.zeros(V_PLACES)
    wheels = []
    for k, i in enumerate(WHEELSETS):
        y_w, dy_w, phi_w, dphi_w = rails[k]
        e, de = q[i] - y_w - c.r * phi_w, v[i] - V * dy_w - c.r * V * dphi_w
        lean, leaning = phi_w - c.sigma * e / c.b, V * dphi_w - c.sigma * de / c.b
        place = (c.a_c if k < 2 else -c.a_c) + (c.a if k % 2 == 0 else -c.a)
        wheel = Solid(place, c.r, np.array([q[i], q[i + 1], lean]), np.array([v[i], v[i + 1], leaning]))
        wheels.append(wheel)
        for side in (1, -1):
            spring(wheel, frames[k // 2], place, side * c.primary_y, c.r, c.primary, c.primary_c, c.primary_load)
    for s, frame in zip((1, -1), frames, strict=True):
        at = s * c.a_c
        for side in (1, -1):
            spring(frame, body, at, side * c.secondary_y, c.secondary_h, c.secondary, c.secondary_c, c.secondary_load)
        roll = (2 * c.bending + c.anti_roll) * (frame.q[2] - body.q[2])
        frame.force[2] -= roll
        body.force[2] += roll
        if full:
            z = frame.end(at, 0, c.secondary_h)[0][1] - body.end(at, 0, c.secondary_h)[0][1]
            F = -c.stop[1] * (z - np.clip(z, -c.stop[0], c.stop[0]))
            frame.push(np.array([0, F, 0]), at, 0, c.secondary_h)
            body.push(np.array([0, -F, 0]), at, 0, c.secondary_h)
    acceleration[0:3] = body.force / [c.m, c.I_z, c.I_x]
    for i, frame in zip(FRAMES, frames, strict=True):
        acceleration[i : i + 3] = frame.force / [c.m_f, c.I_zf, c.I_xf]
    for k, i in enumerate(WHEELSETS):
        Q_y, Q_psi = wheelset_forces(c, wheels[k], V, rails[k], full)
        F_y, M_z, M_x = wheels[k].force
        # the lean that goes with y hands its share of the roll moment back
        acceleration[i] = (Q_y + F_y - c.sigma / c.b * M_x) / c.m_w
        acceleration[i + 1] = (Q_psi + M_z) / c.I_zw
    return np.concatenate([v, acceleration])


def state_matrix(c: Coach, V: float) -> Floats:
    """The linear coach, column by column."""
    still = np.zeros((4, 4))
    zero = rate(c, np.zeros(2 * V_PLACES), V, still, full=False)
    return np.stack([rate(c, x, V, still, full=False) - zero for x in np.eye(2 * V_PLACES)], axis=1)


def march(c: Coach, V: float, dt: float, rails: Floats) -> Floats:
    """States [sample, 34] from rest by fourth-order Runge-Kutta; rails [2 n + 1, 4, 4] at the half steps."""
    x = np.zeros(2 * V_PLACES)
    out = [x]
    for i in range(0, len(rails) - 1, 2):
        s1 = rate(c, x, V, rails[i])
        s2 = rate(c, x + dt / 2 * s1, V, rails[i + 1])
        s3 = rate(c, x + dt / 2 * s2, V, rails[i + 1])
        s4 = rate(c, x + dt * s3, V, rails[i + 2])
        x = x + dt / 6 * (s1 + 2 * s2 + 2 * s3 + s4)
        out.append(x)
    return np.array(out)
