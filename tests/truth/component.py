"""One component of a bogie on a bench: the force with which its spring, damper and effects resist a given motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from tests.truth.bogie import Vehicle
from tests.truth.effects import Effect
from tests.truth.laws import Array, ForceLaw, Parameters
from tests.truth.placed import grouped

STEPS = 40  # of the states of the effects per sample


def component_force(vehicle: Vehicle, effects: Sequence[Effect], at: str, wheelset: int, t: Array, z: Array) -> Array:
    """Force [n] of the component at a place under a motion z [n], a spline through its samples.

    wheelset: 0 where the place has one component.
    """
    k, c = vehicle.declared(at)
    motion = CubicSpline(t, z, bc_type="not-a-knot")
    fine = np.linspace(t[0], t[-1], STEPS * (len(t) - 1) + 1)
    z_fine, v_fine = motion(fine), motion(fine, 1)
    force = k * z_fine + c * v_fine
    here = [e for e in effects if e.at == at and e.wheelset in (None, wheelset)]
    for group in grouped([here], lambda _, place: vehicle.declared(place)):
        if group.kind.law is not None:
            force -= _push(group.kind.law, group.p, group.kind.states, fine, z_fine, v_fine)
    return np.asarray(force[::STEPS])


def _push(law: ForceLaw, p: Parameters, states: int, t: Array, z: Array, v: Array) -> Array:
    """Force [n] of a law on the body; its states by Heun's method."""
    if not states:
        return np.asarray(law(p, z[None, :, None], v[None, :, None], np.zeros((0, 1, 1)), 0.0)[0]).ravel()
    h, x, out = t[1] - t[0], np.zeros((states, 1, 1)), np.zeros(len(t))
    for i in range(len(t)):
        force, rate = law(p, z[i].reshape(1, 1), v[i].reshape(1, 1), x, t[i])
        out[i] = force.item()
        if i + 1 < len(t):
            trial = x + h * rate
            _, ahead = law(p, z[i + 1].reshape(1, 1), v[i + 1].reshape(1, 1), trial, t[i + 1])
            x = x + 0.5 * h * (rate + ahead)
            if "blow_off" in p:
                x = np.clip(x, -p["blow_off"], p["blow_off"])
    return out
