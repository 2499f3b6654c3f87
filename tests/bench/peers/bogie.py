"""The bogie of the standard job as every peer computes it: accelerations from coefficients that are made beforehand.

Broersen (1976), (3.1)-(3.10), with the creep forces in units of the friction limit mu N and every force as an
acceleration: nothing is left to the steps that can be made before them. State x: positions y, psi, y1, psi1, y2, psi2,
then their rates. A row of track: line y_w + r phi_w [m] of both wheelsets and, in the full job, phi_w and what both
slopes take off the creep force.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SUSPENSION = 9  # coefficients, then those of the leading and of the trailing contact
CONTACT = {True: 18, False: 9}  # coefficients per wheelset, full and reduced


def coefficients(p: dict[str, Floats], speed: float, full: bool) -> Floats:
    """Coefficients [coefficient, design] of designs whose parameters [design] stand at their paths."""
    m_b, i_b = p["vehicle.frame.mass"], p["vehicle.frame.yaw_inertia"]
    m, inertia, i_y = (p[f"vehicle.wheelset.{key}"] for key in ("mass", "yaw_inertia", "spin_inertia"))
    keys = ("half_wheelbase", "half_gauge", "half_spring_base", "rolling_radius")
    a, b, b_c, r = (p[f"vehicle.geometry.{key}"] for key in keys)
    n, kappa_s = p["vehicle.wheel_load"], p["contact.spin_creep"]
    c_y, c_x = (2 * p[f"vehicle.primary.{key}_stiffness"] for key in ("lateral", "longitudinal"))
    c_psi, limit = c_x * b_c**2, p["effects.0.friction"] * n
    k_y, k_psi = p["vehicle.secondary.lateral_damping"], p["vehicle.secondary.yaw_damping"]
    rows = [a, c_y / m, c_y / m_b, c_psi / inertia, c_psi / i_b, c_y * a / i_b, k_y / m_b, k_psi / i_b]
    rows.append(p["effects.1.clearance"])
    for where in ("leading", "trailing"):
        words = ("longitudinal_creep", "lateral_creep", "conicity", "gravitational_stiffness", "contact_angle", "roll")
        kappa_x, kappa_y, conicity, epsilon, delta, sigma = (p[f"contact.{where}.{word}"] for word in words)
        kappa_x, kappa_y, kappa_n = kappa_x * n / limit, kappa_y * n / limit, kappa_s * n / limit
        rows += [kappa_x * conicity / r, kappa_x * b / speed, kappa_y * (1 + r * sigma / b) / speed, kappa_y]
        rows += [2 * n * epsilon / (b * m), p["effects.1.stiffness"] / m, limit / m, b * limit / inertia]
        rows.append(2 * n / m)
        if full:
            gyro = i_y * speed * sigma / (b * r)
            rows += [kappa_n / speed, kappa_n * (epsilon - sigma) / (b * r), kappa_n * delta / r]
            rows += [gyro / m, gyro / inertia, 2 * b * n * delta / inertia]
            rows += [kappa_y * r * sigma / b, kappa_y * (1 + r * sigma / b) * r, np.zeros_like(m)]
    return np.ascontiguousarray(np.broadcast_arrays(*rows))


def written(
    full: bool, factor: Callable[[Any], Any], beyond: Callable[[Any, Any], Any], compiled: Callable[[Any], Any]
) -> Callable[[Any, Any, Any], Any]:
    """accelerations(x, c, track) -> six, for numbers, arrays or whatever `factor` and `beyond` take.

    factor(q^2): of a wheel's creep forces; beyond(e, h): the deflection of the flange; compiled: a just-in-time
    compiler, or nothing at all.
    """
    size = CONTACT[full]

    @compiled
    def contact_full(c, k, e, psi, vy, vpsi, phi, dyw, dphi):  # type: ignore[no-untyped-def]
        tx = c[k] * e + c[k + 1] * vpsi
        middle = c[k + 2] * vy + c[k + 9] * vpsi - c[k + 3] * psi - c[k + 10] * e
        middle = middle - c[k + 15] * dyw - c[k + 16] * dphi
        right, left = middle - c[k + 11], middle + c[k + 11]
        along = tx * tx
        f_right, f_left = factor(along + right * right), factor(along + left * left)
        right, left = f_right * right, f_left * left
        a_y = c[k + 8] * phi - c[k + 4] * e - c[k + 5] * beyond(e, c[8]) + c[k + 12] * vpsi - c[k + 6] * (right + left)
        a_psi = (c[k + 7] * (right - left) + c[k + 14]) * psi - c[k + 13] * vy - c[k + 7] * (f_right + f_left) * tx
        return a_y, a_psi

    @compiled
    def contact_reduced(c, k, e, psi, vy, vpsi, phi, dyw, dphi):  # type: ignore[no-untyped-def]
        tx, ty = c[k] * e + c[k + 1] * vpsi, c[k + 2] * vy - c[k + 3] * psi
        f = 2.0 * factor(tx * tx + ty * ty)
        return -c[k + 4] * e - c[k + 5] * beyond(e, c[8]) - c[k + 6] * f * ty, -c[k + 7] * f * tx

    contact = contact_full if full else contact_reduced

    @compiled
    def accelerations(x, c, track):  # type: ignore[no-untyped-def]
        y, psi, y_1, psi_1, y_2, psi_2, vy, vpsi, vy_1, vpsi_1, vy_2, vpsi_2 = x
        line_1, phi_1, dyw_1, dphi_1, line_2, phi_2, dyw_2, dphi_2 = track
        arm = c[0] * psi
        near_1, near_2, twist_1, twist_2 = y_1 - y - arm, y_2 - y + arm, psi_1 - psi, psi_2 - psi
        turning = c[5] * (near_1 - near_2) + c[4] * (twist_1 + twist_2)
        a_1, t_1 = contact(c, 9, y_1 - line_1, psi_1, vy_1, vpsi_1, phi_1, dyw_1, dphi_1)
        a_2, t_2 = contact(c, 9 + size, y_2 - line_2, psi_2, vy_2, vpsi_2, phi_2, dyw_2, dphi_2)
        first = a_1 - c[1] * near_1, t_1 - c[3] * twist_1
        return (
            c[2] * (near_1 + near_2) - c[6] * vy,
            turning - c[7] * vpsi,
            *first,
            a_2 - c[1] * near_2,
            t_2 - c[3] * twist_2,
        )

    return accelerations


def stepping(compiled: Callable[[Any], Any]) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """moved(x, dx, h) = x + h dx, and the end of a step of RK4, both over tuples of twelve."""

    @compiled
    def moved(x, v, a, h):  # type: ignore[no-untyped-def]
        near = x[0] + h * v[6], x[1] + h * v[7], x[2] + h * v[8], x[3] + h * v[9], x[4] + h * v[10], x[5] + h * v[11]
        return (
            *near,
            x[6] + h * a[0],
            x[7] + h * a[1],
            x[8] + h * a[2],
            x[9] + h * a[3],
            x[10] + h * a[4],
            x[11] + h * a[5],
        )

    @compiled
    def ended(x, x_2, x_3, x_4, a_4, h):  # type: ignore[no-untyped-def]
        # x + h/6 (k_1 + 2 k_2 + 2 k_3 + k_4) with the slopes' own states: (x_2 + 2 x_3 + x_4 - x)/3 + h/6 k_4
        third, sixth = 1.0 / 3.0, h / 6.0
        return (
            third * (x_2[0] + 2.0 * x_3[0] + x_4[0] - x[0]) + sixth * x_4[6],
            third * (x_2[1] + 2.0 * x_3[1] + x_4[1] - x[1]) + sixth * x_4[7],
            third * (x_2[2] + 2.0 * x_3[2] + x_4[2] - x[2]) + sixth * x_4[8],
            third * (x_2[3] + 2.0 * x_3[3] + x_4[3] - x[3]) + sixth * x_4[9],
            third * (x_2[4] + 2.0 * x_3[4] + x_4[4] - x[4]) + sixth * x_4[10],
            third * (x_2[5] + 2.0 * x_3[5] + x_4[5] - x[5]) + sixth * x_4[11],
            third * (x_2[6] + 2.0 * x_3[6] + x_4[6] - x[6]) + sixth * a_4[0],
            third * (x_2[7] + 2.0 * x_3[7] + x_4[7] - x[7]) + sixth * a_4[1],
            third * (x_2[8] + 2.0 * x_3[8] + x_4[8] - x[8]) + sixth * a_4[2],
            third * (x_2[9] + 2.0 * x_3[9] + x_4[9] - x[9]) + sixth * a_4[3],
            third * (x_2[10] + 2.0 * x_3[10] + x_4[10] - x[10]) + sixth * a_4[4],
            third * (x_2[11] + 2.0 * x_3[11] + x_4[11] - x[11]) + sixth * a_4[5],
        )

    return moved, ended
