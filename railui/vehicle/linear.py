"""State matrices and eigenvalues of vehicles, with their linear effects or linearised about rest."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.core import Batch, Vehicles, adds_body, effect_record, matrix_eigenvalues
from railui.memo import IdentityCache
from railui.track import Track
from railui.track.excitation import Excitation, TrackSource
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model

STRAIGHT_TRACK: Final = TrackSource(Track(np.arange(4.0), np.zeros(4)), "straight and level")
# m, rad, m/s at which the linearity of a law is tested; 0.1 m would derail
AMPLITUDES: Final = (1e-5, 1e-4, 1e-3, 1e-2, 4e-2)
MIN_ROOT: Final = 1e-6  # 1/s: a smaller root is a constant, which the band of a track does not excite
LINEARITY_TOLERANCE: Final = 1e-8  # relative to the largest derivative
MAX_CACHED_MODELS: Final = 256
_LINEAR_EFFECTS: Final = IdentityCache[tuple[bool, ...]](MAX_CACHED_MODELS)


def state_derivatives(
    model: Model, vehicles: Vehicles, batch: Batch, states: FloatArray, speed: float = 1.0
) -> FloatArray:
    """Return the state derivatives [n, state] of n vehicles in given states on straight level track.

    Parameters
    ----------
    model : Model
    vehicles : Vehicles
    batch : Batch
    states : array [n, state]
    speed : float
        Speed [m/s].
    """
    row = _level_track_row(model.wheelset_distances()).copy()
    row[1] = speed
    return vehicles.state_derivatives(batch, row, states)


@lru_cache(maxsize=64)
def _level_track_row(behind: tuple[float, ...]) -> FloatArray:
    return np.ascontiguousarray(Excitation(STRAIGHT_TRACK, 1.0).table(behind, 1)[0])


def linear_effects(model: Model) -> tuple[bool, ...]:
    """Test for each effect whether twice the motion gives twice the force at any amplitude.

    >>> from railui.vehicle.resolve import resolve_model
    >>> linear_effects(resolve_model("designs/test_bogie.yaml"))
    ()
    """
    key = (model.structure_key, model.row.tobytes())
    return _LINEAR_EFFECTS.get(key, lambda: _test_linearity(model))


def _test_linearity(model: Model) -> tuple[bool, ...]:
    count = len(model.effects)
    if not count:
        return ()
    vehicles, copies = model.vehicles(), model.batch(np.tile(model.row, (count + 1, 1)))
    # the first vehicle has no effect, each other one a single effect
    batch = Batch(copies.numbers, copies.effects, np.vstack([np.zeros(count), np.eye(count)]))
    motion = np.random.default_rng(1).uniform(0.5, 1.0, vehicles.state_count(batch))
    is_linear = np.ones(count, dtype=bool)
    for amplitude in AMPLITUDES:
        states = [np.tile(factor * amplitude * motion, (count + 1, 1)) for factor in (1.0, 2.0, -1.0)]
        derivatives = [state_derivatives(model, vehicles, batch, x, 40.0) for x in states]
        single, double, negative = (x[1:] - x[0] for x in derivatives)
        deviation = np.maximum(np.abs(double - 2 * single).max(axis=1), np.abs(negative + single).max(axis=1))
        is_linear &= deviation <= LINEARITY_TOLERANCE * np.maximum(np.abs(derivatives[1]).max(), 1e-300)
    return tuple(bool(x) for x in is_linear)


def omitted_kinds(model: Model) -> list[str]:
    """Kinds of effects that the linear vehicle lacks, since their forces are not proportional to the motion."""
    return sorted({e.kind for e, yes in zip(model.effects, linear_effects(model), strict=True) if not yes})


def kinds_linearised_at_rest(model: Model) -> list[str]:
    """Kinds of effects in the linear vehicle whose memory is nonlinear, so that their slope at rest stands for them.

    Their forces are proportional to the state of the memory; its rate of change is not proportional to the motion.
    """
    pairs = zip(model.effects, linear_effects(model), strict=True)
    with_memory = [e for e, is_linear in pairs if is_linear and has_memory(e.kind)]
    return sorted({e.kind for e in with_memory if not _has_linear_memory(model, e)})


def linearisation_notes(model: Model, of_omitted: str = "") -> list[str]:
    """Note the effects that the linear vehicle lacks, with a clause on these, then those with their slope at rest."""
    omitted, at_rest = omitted_kinds(model), kinds_linearised_at_rest(model)
    notes = [f"linear: without {', '.join(omitted)}{of_omitted}"] if omitted else []
    return notes + ([f"linear: {', '.join(at_rest)} with the slope at rest, as of small motions"] if at_rest else [])


def has_memory(kind: str) -> bool:
    """True for a kind of effect with internal states that are no motions of a body."""
    return bool(effect_record(kind)["states"] > 0) and not adds_body(kind)


def _has_linear_memory(model: Model, effect: PlacedEffect) -> bool:
    """Test whether twice the state gives twice the rate of change of an effect's memory, at any amplitude."""
    without = Model(model.design.with_effects(()))
    alone = without.with_effect(effect)
    vehicles, batch = alone.vehicles(), alone.single_batch()
    size, first = (m.vehicles().state_count(m.single_batch()) for m in (alone, without))
    motion = np.random.default_rng(1).uniform(0.5, 1.0, (1, size))
    for amplitude in AMPLITUDES:
        single, double = (
            state_derivatives(alone, vehicles, batch, factor * amplitude * motion)[0, first:] for factor in (1.0, 2.0)
        )
        if np.abs(double - 2.0 * single).max() > LINEARITY_TOLERANCE * np.abs(double).max():
            return False
    return True


def state_matrices(model: Model, rows: FloatArray, speeds: FloatArray, *, at_rest: bool = False) -> FloatArray:
    """Return the state matrices [n, state, state] of vehicles, x = [q, q', states of effects].

    Parameters
    ----------
    model : Model
    rows : array [n, row]
        Numbers of the vehicles.
    speeds : array [n]
        Speed of each vehicle [m/s].
    at_rest : bool
        Include all effects, linearised about rest (dry friction is a stiff damper there, a clearance no spring),
        instead of the linear effects only.
    """
    vehicles, batch = _at_speeds(model, rows, speeds, at_rest)
    return vehicles.jacobians(batch, _level_track_row(model.wheelset_distances()))


def eigenvalues(model: Model, rows: FloatArray, speeds: FloatArray, *, at_rest: bool = False) -> ComplexArray:
    """Return the eigenvalues [n, state] of vehicles, largest real part first; parameters as `state_matrices`.

    NaN for a vehicle whose state matrix is not finite.

    >>> from railui.vehicle.resolve import resolve_model
    >>> model = resolve_model("designs/check_bogie.yaml")
    >>> roots = eigenvalues(model, model.row[None], np.array([40.0]))
    >>> complex(roots[0, 0].round(5))
    (-4.41556+22.55234j)
    """
    active = zip(model.effects, _active_effects(model, at_rest), strict=True)
    if all(adds_body(effect.kind) for effect, is_active in active if is_active):
        # the kernel's state matrix includes bodies
        vehicles, batch = _at_speeds(model, rows, speeds, at_rest)
        return vehicles.eigenvalues(batch, 1.0)
    return matrix_eigenvalues(state_matrices(model, rows, speeds, at_rest=at_rest))


def least_damping(roots: ComplexArray) -> FloatArray:
    """Return the damping ratio [...] of the least damped of roots [..., root], but for constants.

    A law with memory adds a root at zero, whose ratio is rounding.

    >>> least_damping(np.array([-1.0 + 1.0j, -2.0 + 0.0j, 1e-13 + 0.0j])).round(4)
    np.float64(0.7071)
    """
    return np.asarray(np.where(np.abs(roots) < MIN_ROOT, np.inf, damping_ratio(roots)).min(axis=-1))[()]


def damping_ratio(roots: ComplexArray) -> FloatArray:
    """Damping ratio -Re(s)/abs(s) of eigenvalues s [1/s]: 0 at the critical speed, 1 without oscillation."""
    size = np.abs(roots)
    return np.asarray(-roots.real / np.where(size > 0, size, 1.0))


def _active_effects(model: Model, at_rest: bool) -> tuple[bool, ...]:
    return (True,) * len(model.effects) if at_rest else linear_effects(model)


def _at_speeds(model: Model, rows: FloatArray, speeds: FloatArray, at_rest: bool) -> tuple[Vehicles, Batch]:
    """Return vehicles with the active effects, and a batch whose speed scales are the speeds [m/s]."""
    batch = model.batch(rows)
    amounts = np.tile(np.asarray(_active_effects(model, at_rest), dtype=float), (len(rows), 1))
    scale = np.ascontiguousarray(np.broadcast_to(np.asarray(speeds, dtype=float), (len(rows),)))
    return model.vehicles(), Batch(batch.numbers, batch.effects, amounts, speed_scale=scale)
