"""The component on a bench: a force by hand for a prescribed motion, and the states of effects by scipy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from railui import core
from railui.arrays import FloatArray
from railui.campaign.segment import Segment
from railui.core import Batch, Placement, Vehicles

DT, N = 1e-3, 1500
T = np.arange(N) * DT
AMPLITUDE, W = 8e-3, 2.0 * np.pi * 3.0
Z, V = AMPLITUDE * np.sin(W * T), AMPLITUDE * W * np.cos(W * T)
K, C, PRELOAD = 4e3, 900.0, 35.0


def force(effects: dict[str, dict[str, Any]], *, measured_speed: FloatArray | None = None) -> FloatArray:
    """Force of a component [n] over the sine, from z alone or with a measured speed."""
    columns = {"t": T, "z": Z, "F": np.zeros(N)} | ({} if measured_speed is None else {"vz": measured_speed})
    rows = [core.effect_numbers(kind, parameters) for kind, parameters in effects.items()]
    placed = [Placement(kind, "rig", None, len(row)) for kind, row in zip(effects, rows, strict=True)]
    vehicles = Vehicles("rig", placed, rig_input="motion")
    tail = np.array([[x for row in rows for x in row]])
    batch = Batch.from_arrays(np.array([[K, C, PRELOAD]]), tail, np.ones((1, len(rows))))
    steps = vehicles.required_steps(batch, 1.0, 1.0, DT)[0]
    table = Segment("", "", 0, columns, DT, "bench").table(0.0, steps)
    series, diverged = vehicles.simulate(batch, table, DT, steps, ["F"])
    assert diverged[0] == -1
    return np.asarray(series[0, 0])


def test_spring_damper_and_preload_give_their_sum_exactly() -> None:
    v = CubicSpline(T, Z, bc_type="natural")(T, 1)
    expected = K * Z + C * v + PRELOAD
    inner = slice(20, -20)  # ends of the spline depend on its end condition
    assert np.abs(force({}) - expected)[inner].max() < 1e-9 * np.abs(expected).max()


def test_a_measured_speed_replaces_the_derivative_of_the_motion() -> None:
    expected = K * Z + 2.0 * C * V + PRELOAD
    assert np.abs(force({}, measured_speed=2.0 * V) - expected).max() < 1e-9 * np.abs(expected).max()


def test_friction_has_the_sign_of_the_speed() -> None:
    friction = force({"dry_friction": {"force": 50.0, "slip_speed": 1e-3}}) - force({})
    fast = np.abs(V) > 0.01
    assert np.abs(friction - 50.0 * np.sign(V))[fast].max() < 1e-6


def test_laws_in_parallel_add_up() -> None:
    laws = {"cubic_stiffness": {"stiffness": 2e8}, "quadratic_damper": {"damping": 3e3}}
    v = CubicSpline(T, Z)(T, 1)
    expected = 2e8 * Z**3 + 3e3 * np.abs(v) * v
    assert np.abs(force(laws) - force({}) - expected)[20:-20].max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("kind", ["hysteresis", "maxwell_damper"])
def test_states_of_effects_follow_the_prescribed_motion(kind: str) -> None:
    if kind == "hysteresis":
        parameters = {"stiffness": 1e5, "yield": 120.0}

        def rate(t: float, x: FloatArray) -> list[float]:
            v = AMPLITUDE * W * np.cos(W * t)
            return [1e5 / 120.0 * (v - 0.5 * (abs(v) * abs(x[0]) * x[0] + v * x[0] ** 2))]

        scale = 120.0
    else:
        parameters, scale = {"stiffness": 5e4, "damping": 2e3}, 1.0

        def rate(t: float, x: FloatArray) -> list[float]:
            return [5e4 * AMPLITUDE * W * np.cos(W * t) - 5e4 / 2e3 * x[0]]

    solution = solve_ivp(rate, (0.0, T[-1]), [0.0], t_eval=T, rtol=1e-10, atol=1e-12)
    expected = scale * solution.y[0]
    found = force({kind: parameters}, measured_speed=V) - force({}, measured_speed=V)
    assert np.abs(found - expected).max() < 1e-3 * np.abs(expected).max()
