"""One case for two implementations: a bogie of the independent generator as rows and a table of the kernel.

Both take fourth-order Runge-Kutta steps over the same splines. With as many steps per sample they make the same
error of discretisation, so their difference is rounding: a different law, sign or term is visible
with any step size. The accuracy of the steps is tested against the reference (test_reference.py).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railui import core
from railui.core import Batch, Placement, Vehicles
from railui.track import input_table
from tests.truth.bogie import Vehicle
from tests.truth.campaign import DECLARED
from tests.truth.effects import PAIRED, Effect
from tests.truth.files import paths, vehicle_of
from tests.truth.road import Table
from tests.truth.tracks import eased, met, quantities

Floats = NDArray[np.float64]
CHANNELS = ("e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2", "psi1", "psi2")
ROUNDING = 1e-9  # of a channel's standard deviation; rounding of 1e-16 after different orders of summation


def asymmetric_bogie(seed: int = 0) -> Vehicle:
    """Return a bogie whose wheel-rail parameters all differ from each other and from the nominal ones."""
    rng = np.random.default_rng([seed, 31])
    fixed = ("vehicle.geometry.rolling_radius", "contact.flange_clearance")
    drawn = {path: x if path in fixed else x * rng.uniform(0.85, 1.15) for path, x in paths(DECLARED).items()}
    return vehicle_of(drawn, DECLARED)


@cache
def tangent_run(seconds: float = 2.0, rate: float = 200.0, speed: float = 40.0, scale: float = 1.0) -> Table:
    """Return a run at constant speed over B176 high with a smooth beginning, without an initial transient."""
    return eased(met(speed, seconds, 3, level="high", scale=scale, rate=rate, spread=0.0), 2.56)


@cache
def accelerating_run(seconds: float = 10.0) -> Table:
    """Return a run whose speed rises by 3 m/s in 10 s, at most 0.5 m/s^2."""
    t = np.arange(round(200.0 * seconds)) / 200.0
    v, s = 31.0 - 1.6 * np.cos(0.3 * t), 31.0 * t - 1.6 / 0.3 * np.sin(0.3 * t)
    rails = {name: one.along(s) for name, one in quantities("high", 100.0 * np.ceil(s[-1] / 100.0 + 1.0), 4).items()}
    return eased(Table(t, s, v, rails["yw"], rails["phiw"], rails["gauge"]), 2.56)


def with_coach_forces(run: Table, qy: float = 0.0, qpsi: float = 0.0) -> Table:
    """Return the run with measured coach forces of this amplitude [N, N*m]; 0 for no measurement."""
    smooth = [np.sin(2.0 * np.pi * run.s / length + 0.4) for length in (31.0, 47.0)]
    return replace(run, Qy=qy * smooth[0] if qy else None, Qpsi=qpsi * smooth[1] if qpsi else None)


def effect_locations(kinds: Sequence[str] = ()) -> Iterator[tuple[str, str, int | None]]:
    """Yield kind, location and wheelset (None for both) of every possible effect of a bogie."""
    for record in core.effect_catalogue():
        if record["acts"] != "sensor" and (not kinds or record["kind"] in kinds):
            for at in (at for at in record["at"] if at != "rig"):
                for wheelset in (None, 1, 2) if at in PAIRED else (None,):
                    yield record["kind"], at, wheelset


# ------------------------------------------------------------------------------------------------- kernel


def numbers(vehicle: Vehicle) -> Floats:
    """Return the numbers of a vehicle in the kernel's order [30]."""
    values = paths(vehicle)
    return np.array([values[path] for path in core.parameter_paths("bogie")])


def effect_row(vehicle: Vehicle, one: Effect) -> list[float]:
    """Return the numbers of an effect in the kernel's order, with those that the generator takes from the vehicle."""
    own = {"flange_contact": {"clearance": vehicle.clearance}}.get(one.kind, {})
    return core.effect_numbers(one.kind, {**own, **one.parameters})


def structure(vehicle: Vehicle, effects: Sequence[Effect] = (), run: Table | None = None) -> Vehicles:
    """Return the kernel's structure of a vehicle with effects and with the measured coach forces of a run."""
    placed = [
        Placement(e.kind, e.at, e.wheelset, len(effect_row(vehicle, e)), e.parameters.get("against")) for e in effects
    ]
    given = (("Qy", run.Qy), ("Qpsi", run.Qpsi)) if run is not None else ()
    return Vehicles("bogie", placed, [name for name, column in given if column is not None])


def batch(
    vehicles: Sequence[Vehicle], effects: Sequence[Sequence[Effect]] | None = None, amount: float = 1.0, **more: Any
) -> Batch:
    """Return a batch of vehicles of one structure, every effect with the same amount."""
    effects = [[] for _ in vehicles] if effects is None else effects
    rows = [[x for e in own for x in effect_row(v, e)] for v, own in zip(vehicles, effects, strict=True)]
    amounts = np.full((len(vehicles), len(effects[0])), amount)
    return Batch.from_arrays(
        np.array([numbers(v) for v in vehicles]), np.array(rows).reshape(len(rows), -1), amounts, **more
    )


def table(run: Table, a: float, steps: int) -> Floats:
    """Return the input table of a run for a wheelbase 2a [m]."""
    return input_table(run.t, run.s, run.v, run.yw, run.phiw, run.gauge, a, steps, run.Qy, run.Qpsi)


def interval(run: Table) -> float:
    """Return the sampling interval [s]."""
    return float((run.t[-1] - run.t[0]) / (len(run.t) - 1))


def required_steps(vehicle: Vehicle, run: Table, effects: Sequence[Effect] = ()) -> int:
    """Return the steps per sample that the kernel requires for a case."""
    made = structure(vehicle, effects, run)
    return made.required_steps(batch([vehicle], [effects]), float(run.v.min()), float(run.v.max()), interval(run))[0]


def kernel(
    vehicle: Vehicle,
    run: Table,
    effects: Sequence[Effect] = (),
    steps: int = 1,
    channels: Sequence[str] = CHANNELS,
    amount: float = 1.0,
    state: Floats | None = None,
) -> dict[str, Floats]:
    """Simulate a vehicle on a run by the kernel; state: q, q', then the states of the effects."""
    one = batch([vehicle], [effects], amount, initial=None if state is None else np.array(state, float)[None])
    made = structure(vehicle, effects, run)
    found, lost = made.simulate(one, table(run, vehicle.a, steps), interval(run), steps, channels)
    assert lost[0] == -1, f"diverged at sample {lost[0]}"
    return dict(zip(channels, found[0], strict=True))


# --------------------------------------------------------------------------------------------------- comparison


def relative_differences(found: Mapping[str, Floats], truth: Mapping[str, Floats]) -> dict[str, float]:
    """Return the largest difference of each channel relative to its standard deviation."""
    return {c: float(np.abs(x - truth[c]).max() / truth[c].std()) for c, x in found.items()}


def assert_same(found: Mapping[str, Floats], truth: Mapping[str, Floats], within: float) -> None:
    """Assert that every channel differs by less than `within` times its standard deviation."""
    beyond = {c: f"{x:.2g}" for c, x in relative_differences(found, truth).items() if not x < within}
    assert not beyond, f"differences {beyond} of the standard deviation, {within:g} is allowed"


def change(found: Mapping[str, Floats], other: Mapping[str, Floats], channel: str = "e1") -> float:
    """Change of a channel by an effect, in units of its standard deviation."""
    return relative_differences({channel: found[channel]}, other)[channel]
