"""One case for two implementations: a bogie of the independent generator as rows and a table of the kernel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railui import core
from railui.core import Batch, Placement, Vehicles
from railui.track import input_table
from tests.truth.bogie import Vehicle
from tests.truth.effects import Effect
from tests.truth.files import paths
from tests.truth.road import Table

Floats = NDArray[np.float64]
CHANNELS = ("e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2", "psi1", "psi2")


def numbers(vehicle: Vehicle) -> Floats:
    """A vehicle's numbers in the kernel's order, shape [30]."""
    values = paths(vehicle)
    return np.array([values[path] for path in core.parameters("bogie")])


def effect_row(vehicle: Vehicle, one: Effect) -> list[float]:
    """An effect's numbers in the kernel's order; what the generator leaves to the vehicle is written out."""
    own = {"flange_contact": {"clearance": vehicle.clearance}}.get(one.kind, {})
    return core.effect_numbers(one.kind, {**own, **one.parameters})


def structure(vehicle: Vehicle, effects: Sequence[Effect], run: Table | None = None) -> Vehicles:
    """The kernel's structure of a vehicle with effects on a run, whose measured coach forces drive it."""
    placed = [Placement(e.kind, e.at, e.wheelset, len(effect_row(vehicle, e))) for e in effects]
    given = (("Qy", run.Qy), ("Qpsi", run.Qpsi)) if run is not None else ()
    return Vehicles("bogie", placed, [name for name, column in given if column is not None])


def batch(vehicles: Sequence[Vehicle], effects: Sequence[Sequence[Effect]], amount: float = 1.0, **more: Any) -> Batch:
    """Vehicles of one structure, a row each, every effect at one amount."""
    rows = [[x for e in own for x in effect_row(v, e)] for v, own in zip(vehicles, effects, strict=True)]
    amounts = np.full((len(vehicles), len(effects[0])), amount)
    return Batch.of(np.array([numbers(v) for v in vehicles]), np.array(rows).reshape(len(rows), -1), amounts, **more)


def table(run: Table, a: float, steps: int) -> Floats:
    """The input table of a run for a wheelbase 2a [m]."""
    return input_table(run.t, run.s, run.v, run.yw, run.phiw, run.gauge, a, steps, run.Qy, run.Qpsi)


def kernel(
    vehicle: Vehicle,
    run: Table,
    effects: Sequence[Effect] = (),
    steps: int = 2,
    channels: Sequence[str] = CHANNELS,
    amount: float = 1.0,
    state: Floats | None = None,
) -> dict[str, Floats]:
    """Channels of one vehicle along a run by the kernel; state: q then q', and those of the effects."""
    one = batch([vehicle], [effects], amount, initial=None if state is None else np.atleast_2d(state).astype(float))
    made = structure(vehicle, effects, run)
    found, lost = made.simulate(one, table(run, vehicle.a, steps), float(run.t[1] - run.t[0]), steps, channels)
    assert lost[0] == -1, f"diverged at sample {lost[0]}"
    return dict(zip(channels, found[0], strict=True))


def apart(found: Mapping[str, Floats], truth: Mapping[str, Floats], samples: slice = slice(None)) -> dict[str, float]:
    """Largest difference of each channel in units of its own standard deviation."""
    return {c: float(np.abs(x - truth[c])[samples].max() / truth[c][samples].std()) for c, x in found.items()}


def worst(found: Mapping[str, Floats], truth: Mapping[str, Floats]) -> float:
    """The largest of `apart`."""
    return max(apart(found, truth).values())
