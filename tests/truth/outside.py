"""Discrepancies outside the catalogue of effects, which the identification must not name as one of them.

A law here may look at several places and push at several: it takes (p, z, v, push, x, t), where z(place) and
v(place) give motion and rate, push(place, force) adds a force; it returns the rate of its own states.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tests.truth.laws import Array, Parameters

Look = Callable[[str], Array]
Push = Callable[[str, Array], None]
OutsideLaw = Callable[[Parameters, Look, Look, Push, Array, float], Array | None]


def primary_drift(p: Parameters, z: Look, v: Look, push: Push, x: Array, t: float) -> None:
    """Primary springs that soften as they warm: the declared stiffness times 1 + share t/seconds."""
    grown = p["share"] * min(max(t, 0.0), 600.0) / p["seconds"]
    push(p["at"], -p["k0"] * grown * z(p["at"]))


def lateral_yaw_coupling(p: Parameters, z: Look, v: Look, push: Push, x: Array, t: float) -> None:
    """A slanting arm: lateral force per yaw and yaw moment per lateral deflection, symmetric (no work)."""
    push("primary_lateral", -p["stiffness"] * z("primary_yaw"))
    push("primary_yaw", -p["stiffness"] * z("primary_lateral"))


def crossed_damping(p: Parameters, z: Look, v: Look, push: Push, x: Array, t: float) -> None:
    """Negative damping between the leading wheelset's yaw and the trailing one's lateral motion."""
    yaw, lateral = v("wheelset_yaw"), v("wheelset")
    nothing = np.zeros_like(yaw[0])
    push("wheelset_yaw", np.stack([p["damping"] * lateral[1], nothing]))
    push("wheelset", np.stack([nothing, p["damping"] * yaw[0]]))


def frame_rumble(p: Parameters, z: Look, v: Look, push: Push, x: Array, t: float) -> None:
    """An unmeasured random force on the frame, flat up to `highest` [Hz], standard deviation `force` [N]."""
    force = np.empty((1, len(p["force"])))
    for k, (omega, phase) in enumerate(p["harmonics"]):
        force[0, k] = p["force"][k] * np.sqrt(2.0 / len(omega)) * np.cos(omega * t + phase).sum()
    push(p["at"], force)


def ageing_friction(p: Parameters, z: Look, v: Look, push: Push, x: Array, t: float) -> Array:
    """Stick-slip with a memory: friction that heals at rest by `rise` and is broken by sliding.

    A, 0 to 1, is the rest it has had: A' = (exp(-(v/(5 v_0))^2) - A)/healing;
    F = -F_c (1 + rise A) tanh(v/v_0).
    """
    rate, age = v(p["at"]), x[0]
    push(p["at"], -p["force"] * (1.0 + p["rise"] * age) * np.tanh(rate / p["slip_speed"]))
    rested: Array = np.exp(-((rate / (5.0 * p["slip_speed"])) ** 2))
    return np.asarray((rested - age) / p["healing"])[None]


def switching_damper(p: Parameters, z: Look, v: Look, push: Push, x: Array, t: float) -> None:
    """A damper whose valve changes between 1 - depth and 1 + depth of its value every half period [s]."""
    level = 1.0 + p["depth"] * np.tanh(8.0 * np.sin(2.0 * np.pi * t / p["period"]))
    push(p["at"], -p["damping"] * level * v(p["at"]))


def fading_damper(p: Parameters, z: Look, v: Look, push: Push, x: Array, t: float) -> Array:
    """A damper that loses force as it heats: F = -c v/(1 + E/E_0), E' = c v^2/(1 + E/E_0) - E/cooling."""
    rate, heat = v(p["at"]), x[0]
    c: Array = p["damping"] / (1.0 + heat / p["energy"])
    push(p["at"], -c * rate)
    return np.asarray(c * rate * rate - heat / p["cooling"])[None]


def hung_mass(p: Parameters, z: Look, v: Look, push: Push, x: Array, t: float) -> Array:
    """A motor hung from the frame on a spring and damper: an undeclared mass (states z_m, v_m)."""
    stretch, rate = x[0] - z(p["at"]), x[1] - v(p["at"])
    force = p["stiffness"] * stretch + p["damping"] * rate
    push(p["at"], force)
    return np.stack([x[1], -force / p["mass"]])
