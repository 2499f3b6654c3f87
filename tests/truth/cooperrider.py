"""Cooperrider's bogie in Kaas-Petersen's own form: seven degrees of freedom, equation by equation, plain numpy.

Source: C. Kaas-Petersen, Chaos in a railway bogie, Acta Mechanica 61 (1986). q1, q3 lateral and q2, q4 yaw of the
wheelsets, q5, q6, q7 lateral, yaw and roll of the frame; his roll turns the other way round than that of railui.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

m_w, I_w, m_f, I_fy, I_fr = 1022.0, 678.0, 2918.0, 6780.0, 6780.0
a, b, d1, d2, h1, h2, r0, lam = 0.7163, 1.074, 0.620, 0.680, 0.0762, 0.6584, 0.4572, 0.05
k1, k2, k3, k4, k5, k6 = 1.823e6, 3.646e6, 3.646e6, 1.823e5, 3.333e5, 2.710e6
D1, D2, D6 = 20.0e3, 29.2e3, 500.0
Gab, phi, psi, muN = 6.563e6, 0.60252, 0.54219, 1e4
k_flange, clearance = 14.60e6, 9.1e-3


def creep(xi_x: float, xi_y: float, V: float, saturated: bool) -> tuple[float, float]:
    """F_x, F_y by Vermeulen and Johnson; linear where they do not saturate."""
    across, along = xi_y / psi, xi_x / phi
    xi_R = np.hypot(along, across)
    if not saturated or xi_R == 0.0:
        return Gab * along, Gab * across
    u = Gab * xi_R / muN
    F_R = muN * (u - u**2 / 3 + u**3 / 27 if u < 3 else 1.0)
    return along * F_R / xi_R, across * F_R / xi_R


def rate(x: Floats, V: float, y_w: tuple[float, float] = (0.0, 0.0), full: bool = True) -> Floats:
    """x' of x = [q1 .. q7, q1' .. q7'] over rails that lie y_w to the right under each wheelset."""
    q1, q2, q3, q4, q5, q6, q7, v1, v2, v3, v4, v5, v6, v7 = x
    A1 = 2 * k1 * (q1 - q5 - b * q6 - h1 * q7)
    A2 = 2 * k1 * (q3 - q5 + b * q6 - h1 * q7)
    A3 = 2 * k2 * d1**2 * (q2 - q6)
    A4 = 2 * k2 * d1**2 * (q4 - q6)
    A5 = 2 * D2 * (v5 - h2 * v7) + 2 * k4 * (q5 - h2 * q7)
    A6 = k6 * q6 + D6 * v6
    A7 = 2 * D1 * d2**2 * v7 + 2 * k5 * d2**2 * q7 + 4 * k3 * d1**2 * q7
    wheels = []
    for q_y, q_psi, v_y, v_psi, rail in ((q1, q2, v1, v2, y_w[0]), (q3, q4, v3, v4, y_w[1])):
        e = q_y - rail
        F_x, F_y = creep(a * v_psi / V + lam * e / r0, v_y / V - q_psi, V, full)
        F_T = k_flange * (e - np.clip(e, -clearance, clearance)) if full else 0.0
        wheels.append((-2 * F_y - F_T, -2 * a * F_x))
    (Y1, M1), (Y2, M2) = wheels
    acceleration = [
        (-A1 + Y1) / m_w,
        (-A3 + M1) / I_w,
        (-A2 + Y2) / m_w,
        (-A4 + M2) / I_w,
        (A1 + A2 - A5) / m_f,
        (b * A1 - b * A2 + A3 + A4 - A6) / I_fy,
        (h1 * A1 + h1 * A2 + h2 * A5 - A7) / I_fr,
    ]
    return np.array([v1, v2, v3, v4, v5, v6, v7, *acceleration])


def state_matrix(V: float) -> Floats:
    """The linear bogie, column by column."""
    return np.stack([rate(column, V, full=False) for column in np.eye(14)], axis=1)


def march(x: Floats, V: float, dt: float, rails: Floats) -> Floats:
    """States [sample, 14] by fourth-order Runge-Kutta; rails [2 n + 1, 2] at the half steps."""
    out = [x]
    for i in range(0, len(rails) - 1, 2):
        at = [tuple(rail) for rail in rails[i : i + 3]]
        s1 = rate(x, V, at[0])
        s2 = rate(x + dt / 2 * s1, V, at[1])
        s3 = rate(x + dt / 2 * s2, V, at[1])
        s4 = rate(x + dt * s3, V, at[2])
        x = x + dt / 6 * (s1 + 2 * s2 + 2 * s3 + s4)
        out.append(x)
    return np.array(out)
