"""Force laws of the catalogue of effects: motion and rate at a place to the force on the body there.

Every law takes (p, z, v, x, t): parameters per vehicle, motion and rate [row, vehicle], its own states
[state, row, vehicle] and the time; it returns the force in the direction of z and the rate of its states.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Parameters = Mapping[str, Any]
ForceLaw = Callable[[Parameters, Array, Array, Array, float], tuple[Array, Array | None]]


def beyond(z: Array, h: Array) -> Array:
    """Return the part of z beyond +/-h, with its sign [unit of z]."""
    return z - np.minimum(np.maximum(z, -h), h)


def spring(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, None]:
    return -p["stiffness"] * z, None


def viscous_damper(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, None]:
    return -p["damping"] * v, None


def free_play(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, None]:
    # added to the declared -k0 z, so that together they act on what lies beyond the play
    return p["k0"] * (z - beyond(z, p["half_width"])), None


def cubic_stiffness(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, None]:
    return -p["stiffness"] * z * z * z, None


def quadratic_stiffness(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, None]:
    return -p["stiffness"] * z * z, None


def bump_stop(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, None]:
    return -p["stiffness"] * beyond(z, p["gap"]), None


def dry_friction(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, None]:
    return -p["force"] * np.tanh(v / p["slip_speed"]), None


def hysteresis(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, Array]:
    w = x[0]
    rate = (p["stiffness"] / p["yield"]) * (v - 0.5 * (np.abs(v) * np.abs(w) * w + v * w * w))
    return -p["yield"] * w, rate[None]


def quadratic_damper(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, None]:
    return -p["damping"] * np.abs(v) * v, None


def asymmetric_damper(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, None]:
    return -p["ratio"] * p["c0"] * np.maximum(v, 0.0), None


def maxwell_damper(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, Array]:
    f = x[0]
    rate = p["stiffness"] * v - (p["stiffness"] / p["damping"]) * f
    # the valve opens: the force does not grow beyond the blow-off
    rate = np.where((np.abs(f) >= p["blow_off"]) & (rate * f > 0.0), 0.0, rate)
    return -f, rate[None]


def run_out(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, None]:
    return p["force"] * np.sin(p["s"] / p["rolling_radius"] + p["phase"]) + 0.0 * z, None


def steady_force(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, None]:
    return p["force"] + 0.0 * z, None


def measured_force(p: Parameters, z: Array, v: Array, x: Array, t: float) -> tuple[Array, None]:
    force = np.empty(np.broadcast(z, v).shape)
    for k, against in enumerate(p["against"]):
        seen = v if against == "v" else z
        force[:, k] = np.interp(seen[:, k], p["motion"][k], p["force"][k])
    return force, None


# laws of creep, by the number that a field of the contact chain holds
CREEP_LAWS = ("creep_saturation", "vermeulen_johnson", "shen_hedrick_elkins", "polach")


def creep_forces(c: Parameters, N: Array, T_x: Array, T_y: Array, spin: Array, slip: Array) -> tuple[Array, Array]:
    """T_x, T_y of a wheel whose linear law gives T_x, T_y (spin: its part of T_y), sliding at `slip` [m/s].

    Vermeulen and Johnson (1964): no spin. Shen, Hedrick and Elkins (1983): Kalker's forces with spin, times the factor
    of Vermeulen and Johnson. Polach (2005): F = (2 Q mu/pi) (k_A e/(1 + (k_A e)^2) + atan(k_S e)), e the gradient of
    the tangential stress, (pi/4) of linear force over limit; mu = mu_0 ((1 - A) exp(-B w) + A).
    """
    without_spin = c["law"] == CREEP_LAWS.index("vermeulen_johnson")
    X = c["p_x"] * T_x
    Y = np.where(without_spin, c["p_y"] * (T_y - spin), c["p_x"] * T_y)
    f = saturation(np.hypot(X, Y) / (c["mu"] * N))
    X, Y = f * X, f * Y
    polach = c["law"] == CREEP_LAWS.index("polach")
    if not polach.any():
        return X, Y
    limit = np.where(polach, c["mu"], 1.0) * ((1.0 - c["A"]) * np.exp(-c["B"] * slip) + c["A"]) * N
    T = np.maximum(np.hypot(T_x, T_y), 1e-9)
    e = 0.25 * np.pi * T / limit
    F = 2.0 * limit / np.pi * (c["k_A"] * e / (1.0 + (c["k_A"] * e) ** 2) + np.arctan(c["k_S"] * e))
    return np.where(polach, F * T_x / T, X), np.where(polach, F * T_y / T, Y)


def saturation(q: Array) -> Array:
    """Vermeulen and Johnson: factor on both creep forces at q = T/(mu N)."""
    return np.where(q < 3.0, 1.0 - q / 3.0 + q * q / 27.0, 1.0 / np.maximum(q, 3.0))


def saturation_slope(q: Array) -> Array:
    """Derivative of the factor of Vermeulen and Johnson after q."""
    return np.where(q < 3.0, -1.0 / 3.0 + 2.0 * q / 27.0, -1.0 / np.maximum(q, 3.0) ** 2)
