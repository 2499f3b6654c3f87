"""The one-mass rig of the kernel against that of the independent generator: three inputs, free decay, effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from railui import core
from railui.core import Batch, Placement, Vehicles
from tests.kernel.pairs import ROUNDING, Floats, assert_same, relative_differences
from tests.truth.effects import KINDS, Effect, effect, parse
from tests.truth.rig import Rig, respond

RATE, SECONDS, STEPS = 1000.0, 0.6, 2
T = np.arange(round(RATE * SECONDS)) / RATE
CHANNELS = ("z", "vz", "az")
# in the size of what the rig does: 2 mm at 25 rad/s on 60 kN/m
RIG_SIZE = (2e-3, 0.05, 6e4)
SIZED: dict[str, dict[str, Any]] = {
    "spring": {"stiffness": 3e4},
    "viscous_damper": {"damping": 400.0},
    "free_play": {"half_width": 1e-3},
    "cubic_stiffness": {"stiffness": 1e10},
    "quadratic_stiffness": {"stiffness": 2e6},
    "bump_stop": {"gap": 1e-3, "stiffness": 1e5},
    "dry_friction": {"force": 40.0, "slip_speed": 0.01},
    "hysteresis": {"stiffness": 4e4, "yield": 40.0},
    "quadratic_damper": {"damping": 5e3},
    "asymmetric_damper": {"ratio": 2.0},
    "maxwell_damper": {"stiffness": 6e4, "damping": 1e3},
    "measured_force": {"motion": [-3e-3, -1e-3, 5e-4, 2e-3], "force": [90.0, 10.0, -30.0, -60.0], "against": "v"},
}
EFFECTS = {
    kind: SIZED[kind] if kind in SIZED else known.example(*RIG_SIZE)
    for kind, known in KINDS.items()
    if "rig" in known.at and (kind in SIZED or known.example is not None)
}
INPUTS = {"force": 120.0, "base_displacement": 1.2e-3, "base_acceleration": 1.2}  # amplitude in the unit of u


def shaken(kind: str) -> Floats:
    """An input of many frequencies about the rig's 4 Hz that starts from nothing."""
    rng = np.random.default_rng(3)
    f, phase = np.geomspace(0.8, 16.0, 20), rng.uniform(0.0, 2.0 * np.pi, 20)
    whole = np.cos(2.0 * np.pi * f * T[:, None] + phase).sum(axis=1) / np.sqrt(10.0)
    start = np.clip(T / 0.2, 0.0, 1.0)
    return np.asarray(INPUTS[kind] * whole * start**3 * (10.0 - 15.0 * start + 6.0 * start**2))


def kernel(
    rig: Rig,
    u: Floats | None,
    effects: Sequence[Effect] = (),
    start: tuple[float, float] = (0.0, 0.0),
    steps: int = STEPS,
) -> dict[str, Floats]:
    """Channels of the kernel's rig: rows t, 1, u, u', u'' at the half steps; start is (z, v).

    Over a moving base its co-ordinate is the deflection z - gain u.
    """
    rows = [core.effect_numbers(e.kind, dict(e.parameters)) for e in effects]
    against = [e.parameters.get("against") for e in effects]
    placed = [Placement(e.kind, e.at, None, len(row), x) for e, row, x in zip(effects, rows, against, strict=True)]
    vehicles = Vehicles("rig", placed, rig_input=rig.input)
    numbers = np.array([[rig.m, rig.k, rig.c, rig.gain, 0.0]])
    one = Batch.from_arrays(numbers, np.array([[x for row in rows for x in row]]), np.ones((1, len(rows))))
    at = np.arange(2 * steps * (len(T) - 1) + 1) / (2 * steps * RATE)
    table = np.zeros((len(at), 5))
    table[:, 0], table[:, 1] = at, 1.0
    if u is not None:
        table[:, 2:] = np.stack([CubicSpline(T, u)(at, order) for order in range(3)], axis=1)
    base = rig.gain * table[0, 2:4] if rig.input == "base_displacement" else 0.0
    initial = (np.array(start, float) - base)[None]
    found, lost = vehicles.simulate(one.with_initial_states(initial), table, 1 / RATE, steps, CHANNELS)
    assert lost[0] == -1
    return dict(zip(CHANNELS, found[0], strict=True))


def change(found: Mapping[str, Floats], other: Mapping[str, Floats]) -> float:
    return relative_differences({"z": found["z"]}, other)["z"]


def test_every_effect_that_may_be_at_a_rig_is_tried_here() -> None:
    assert {r["kind"] for r in core.effect_catalogue() if "rig" in r["at"]} == set(EFFECTS)


@pytest.mark.parametrize("kind", INPUTS)
@pytest.mark.parametrize("gain", [1.0, -0.7])
def test_a_linear_rig_responds_as_the_reference(kind: str, gain: float) -> None:
    rig, u = Rig(gain=gain, input=kind), shaken(kind)
    assert_same(kernel(rig, u), respond(rig, T, u, steps=STEPS), 1e-5)


@pytest.mark.parametrize("kind", INPUTS)
@pytest.mark.parametrize("name", EFFECTS)
def test_a_rig_with_an_effect_responds_as_the_reference(kind: str, name: str) -> None:
    rig, u, one = Rig(input=kind), shaken(kind), [effect(name, "rig", **EFFECTS[name])]
    # over a moving base the two take different co-ordinates, whose steps err differently at the corners of a law
    steps, within = (2 * STEPS, 1e-5) if kind == "base_displacement" else (STEPS, ROUNDING)
    found = kernel(rig, u, one, steps=steps)
    assert change(found, kernel(rig, u)) > 1e-2
    assert_same(found, respond(rig, T, u, one, steps=steps), within)


@pytest.mark.parametrize("name", EFFECTS)
def test_a_rig_with_an_effect_rings_down(name: str) -> None:
    rig, one, start = Rig(), [effect(name, "rig", **EFFECTS[name])], (4e-3, -0.02)
    found = kernel(rig, None, one, start)
    assert change(found, kernel(rig, None, start=start)) > 1e-2
    assert_same(found, respond(rig, T, None, one, start, steps=STEPS), ROUNDING)


def test_a_free_rig_rings_down_as_the_textbook_says() -> None:
    rig = Rig()
    fade = rig.c / (2.0 * rig.m)
    w = np.sqrt(rig.k / rig.m - fade**2)
    exact = 4e-3 * np.exp(-fade * T) * (np.cos(w * T) + fade / w * np.sin(w * T))
    assert np.abs(kernel(rig, None, start=(4e-3, 0.0))["z"] - exact).max() < 1e-7 * 4e-3


def test_effects_at_a_rig_act_side_by_side() -> None:
    together = [
        parse("free_play at=rig half_width=5e-4"),
        parse("hysteresis at=rig stiffness=4e4 yield=30"),
        parse("maxwell_damper at=rig stiffness=6e4 damping=800"),
        parse("dry_friction at=rig force=10 slip_speed=0.02"),
    ]
    rig, u = Rig(), shaken("force")
    assert_same(kernel(rig, u, together), respond(rig, T, u, together, steps=STEPS), ROUNDING)


def test_a_blown_off_damper_at_a_rig_gives_no_more_than_its_limit() -> None:
    one = [effect("maxwell_damper", "rig", stiffness=6e4, damping=1e3, blow_off=30.0)]
    rig, u = Rig(), shaken("force")
    found, truth = kernel(rig, u, one), respond(rig, T, u, one, steps=8)
    assert change(found, kernel(rig, u, [effect("maxwell_damper", "rig", stiffness=6e4, damping=1e3)])) > 0.05
    assert_same({"z": found["z"], "vz": found["vz"]}, truth, 1e-4)
    force = rig.m * found["az"] + rig.c * found["vz"] + rig.k * found["z"] - u
    assert np.abs(force).max() < 30.0 * (1.0 + 1e-9)


def test_a_base_moving_from_the_first_sample_starts_with_the_mass_at_rest() -> None:
    rig, u = Rig(gain=0.8, input="base_displacement"), 2e-3 * np.cos(15.0 * T + 0.5)
    found = kernel(rig, u)
    assert found["z"][0] == pytest.approx(0.0, abs=1e-15)
    assert_same(found, respond(rig, T, u, steps=STEPS), 1e-5)


def test_the_rig_in_other_units_is_the_same_rig() -> None:
    # kN, mm: a stiffness in N/mm and a mass in t
    rig, u = Rig(), shaken("force")
    other = replace(rig, m=rig.m * 1e-3, k=rig.k * 1e-3, c=rig.c * 1e-3)
    assert np.allclose(kernel(other, u)["z"], 1e3 * kernel(rig, u)["z"], rtol=0.0, atol=1e-9)
