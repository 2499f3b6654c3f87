"""The linear vehicle: its state matrix, with the effects that are linear or with all of them as they are at rest."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.core import Batch, Vehicles, eigenvalues_of
from railui.track import Track
from railui.track.excitation import Excitation, TrackSource
from railui.vehicle.model import Model

STRAIGHT: Final = TrackSource(Track(np.arange(4.0), np.zeros(4)), "straight and level")
# m, rad, m/s where a law is asked whether it is linear; 0.1 m derails
AMPLITUDES: Final = (1e-5, 1e-4, 1e-3, 1e-2, 4e-2)
NUDGE: Final = 1e-9  # of a state from rest, where nothing cancels: smaller than any slip speed or play
MOST: Final = 256  # vehicles of which it is remembered
_LINEAR: dict[Any, tuple[bool, ...]] = {}


def is_lateral(dof: str) -> bool:
    """Is a degree of freedom a lateral displacement?

    >>> [is_lateral(dof) for dof in ("y", "y1", "y_c", "y.frame", "psi1", "phi.frame")]
    [True, True, True, True, False, False]
    """
    return dof.startswith("y")


def rates(model: Model, vehicles: Vehicles, batch: Batch, states: FloatArray, speed: float = 1.0) -> FloatArray:
    """Rate of change [n, states] of n vehicles in given states [n, states] on straight level track at a speed [m/s]."""
    row = _level(model.behind()).copy()
    row[1] = speed
    return vehicles.rates(batch, row, states)


@lru_cache(maxsize=64)
def _level(behind: tuple[float, ...]) -> FloatArray:
    return np.ascontiguousarray(Excitation(STRAIGHT, 1.0).table(behind, 1)[0])


def linear_effects(model: Model) -> tuple[bool, ...]:
    """Which effects of a vehicle are linear: at twice the motion they give twice the force, at any amplitude.

    >>> from railui.ride_quality.evaluation import model_of
    >>> linear_effects(model_of("designs/test_bogie.yaml"))
    ()
    """
    key = (model.form, model.row.tobytes())
    if key not in _LINEAR:
        _LINEAR[key] = _linear_effects(model)
        for oldest in list(_LINEAR)[:-MOST]:
            _LINEAR.pop(oldest, None)
    return _LINEAR[key]


def _linear_effects(model: Model) -> tuple[bool, ...]:
    count = len(model.effects)
    if not count:
        return ()
    vehicles, one = model.vehicles(), model.batch(np.tile(model.row, (count + 1, 1)))
    batch = Batch(one.numbers, one.effects, np.vstack([np.zeros(count), np.eye(count)]))
    some = np.random.default_rng(1).uniform(0.5, 1.0, vehicles.states(batch))  # a motion of everything at once
    linear = np.ones(count, dtype=bool)
    for size in AMPLITUDES:
        moved = [np.tile(factor * size * some, (count + 1, 1)) for factor in (1.0, 2.0, -1.0)]
        found = [rates(model, vehicles, batch, x, 40.0) for x in moved]
        one_time, twice, back = (x[1:] - x[0] for x in found)
        off = np.maximum(np.abs(twice - 2 * one_time).max(axis=1), np.abs(back + one_time).max(axis=1))
        linear &= off <= 1e-8 * np.maximum(np.abs(found[1]).max(), 1e-300)
    return tuple(bool(x) for x in linear)


def state_matrices(model: Model, rows: FloatArray, speeds: FloatArray, *, at_rest: bool = False) -> FloatArray:
    """State matrices [n, states, states] of vehicles [n, row], each at its speed [m/s], x = [q, q', own states].

    With the effects that are linear; `at_rest`: with all of them, by their slopes where the vehicle stands
    still (a dry friction is a stiff damper there, a free play no spring). By central differences of the
    kernel's own rate of change about zero, where linear terms lose no digit.
    """
    vehicles, batch = _scaled(model, rows, speeds, at_rest)
    n, states = len(rows), vehicles.states(batch)
    nudges = NUDGE * np.vstack([np.eye(states), -np.eye(states)])
    each = batch.select(np.repeat(np.arange(n), 2 * states))
    found = rates(model, vehicles, each, np.tile(nudges, (n, 1)))
    found = found.reshape(n, 2, states, states)
    with np.errstate(over="ignore", invalid="ignore"):  # of masses next to nothing
        slopes: FloatArray = (found[:, 0] - found[:, 1]) / (2 * NUDGE)
    return np.ascontiguousarray(np.swapaxes(slopes, 1, 2))


def eigenvalues(model: Model, rows: FloatArray, speeds: FloatArray, *, at_rest: bool = False) -> ComplexArray:
    """Eigenvalues [n, states] of vehicles [n, row], each at its speed [m/s], largest real part first.

    NaN where a vehicle has none, since its state matrix is not finite.

    >>> from railui.ride_quality.evaluation import model_of
    >>> model = model_of("designs/check_bogie.yaml")
    >>> found = eigenvalues(model, model.row[None], np.array([40.0]))
    >>> complex(found[0, 0].round(5))
    (-4.41556+22.55234j)
    """
    acting = [e.kind for e, yes in zip(model.effects, _active(model, at_rest), strict=True) if yes]
    if set(acting) <= {"coach_mode"}:  # a body, which the kernel's own matrix has
        vehicles, batch = _scaled(model, rows, speeds, at_rest)
        return vehicles.eigenvalues(batch, 1.0)
    return eigenvalues_of(state_matrices(model, rows, speeds, at_rest=at_rest))


def damping_ratio(roots: ComplexArray) -> FloatArray:
    """-Re(s)/abs(s) of eigenvalues 1/s: 0 at the critical speed, negative above, 1 without oscillation."""
    size = np.abs(roots)
    return np.asarray(-roots.real / np.where(size > 0, size, 1.0))


def _active(model: Model, at_rest: bool) -> tuple[bool, ...]:
    return (True,) * len(model.effects) if at_rest else linear_effects(model)


def _scaled(model: Model, rows: FloatArray, speeds: FloatArray, at_rest: bool) -> tuple[Vehicles, Batch]:
    """Vehicles whose shares of the speed 1 m/s are their speeds, with the effects that act."""
    batch = model.batch(rows)
    amounts = np.tile(np.asarray(_active(model, at_rest), dtype=float), (len(rows), 1))
    scale = np.ascontiguousarray(np.broadcast_to(np.asarray(speeds, dtype=float), (len(rows),)))
    return model.vehicles(), Batch(batch.numbers, batch.effects, amounts, speed_scale=scale)
