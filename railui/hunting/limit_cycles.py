"""Hunting: limit cycles with flange contact followed by speed, the fold where they die, and what starts them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.hunting.continuation import Cycle, continue_branch
from railui.hunting.critical_speed import SLOWEST
from railui.hunting.tangent_track import Motion, TangentTrackRuns
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model

LANES: Final = 16  # speeds looked at side by side
CLOSE: Final = 0.01  # m/s of the fold
LARGE: Final = 0.5  # of the clearance: with less a vehicle does not hunt from flange to flange
GONE: Final = 1e-3  # of the clearance: no motion any more
PUT_ASIDE: Final = 1.5  # of the clearance: what starts hunting where anything does
NUDGED: Final = 0.02  # of the clearance: a disturbance that every track has
PATIENT: Final = 100e3  # m along which a small disturbance may grow
WATCHED: Final = 8  # pieces of track in which it falls all the time, if it dies slowly
DWINDLES: Final = 0.7  # of the fold, to which hunting that dwindles is shown
START: Final = 3  # of the speeds near the fold, where shooting begins
SMALLEST: Final = 0.03  # of the clearance, to which the unstable cycle is followed
NEAR: Final = (0.0, 0.02, 0.1, 0.3, 0.7, 1.5)  # m/s above the fold where the branch is steep


def with_flange(model: Model) -> tuple[Model, list[str]]:
    """The vehicle with flange contact, added where its design has none, and notes on what it lacks."""
    kinds = {effect.kind for effect in model.design.effects}
    notes = []
    if "flange_contact" not in kinds:
        contact = PlacedEffect("flange_contact", "contact", None, {})
        model = Model(model.design.with_effects((*model.design.effects, contact)), model.sensors)
        notes.append("fold: flange_contact is not in the design and was added with its defaults")
    if "creep_saturation" not in kinds:
        notes.append("fold: creep forces without bound; creep_saturation among the effects changes the fold")
    return model, notes


@dataclass(frozen=True, eq=False)
class LimitCycles:
    """Hunting of one vehicle on straight track.

    fold [m/s]: below it hunting dies, None where none was found. hard: it jumps there to something small or to
    rest; else it dwindles, and the fold is where it no longer reaches the flanges.
    from_above: steady motion at the speeds above the fold; from_below: what a small disturbance becomes;
    branch: the cycle followed round the fold by shooting, stable above it, then unstable.
    """

    fold: float | None
    hard: bool
    from_above: Motion
    from_below: Motion
    clearance: float
    branch: tuple[Cycle, ...] = ()

    def rows(self) -> list[dict[str, Any]]:
        """One row per speed: amplitude from_above and from_below [m] and the frequency of hunting [Hz]."""
        above = _by_speed(self.from_above)
        below = _by_speed(self.from_below)
        found = []
        for v in sorted({*above, *below}):
            large, small = above.get(v), below.get(v)
            found.append(
                {
                    "speed": v,
                    "from_above": None if large is None else large[0],
                    "from_below": None if small is None else small[0],
                    "frequency": None if large is None else large[1],
                }
            )
        return found


def _by_speed(motion: Motion) -> dict[float, tuple[float, float]]:
    rows = zip(motion.speeds, motion.amplitudes, motion.frequencies, strict=True)
    return {float(v): (float(a), float(f)) for v, a, f in rows}


def find_limit_cycles(
    model: Model,
    speeds: Sequence[float],
    *,
    diagram: bool = True,
    jobs: int | None = None,
    told: Callable[[str], None] = lambda _: None,
) -> LimitCycles:
    """Hunting of a vehicle (with flange contact, see `with_flange`) between the least and the largest speed [m/s].

    The vehicle is put aside at all speeds; where it goes on hunting from flange to flange, that motion is taken
    to lower speeds, sixteen at a time, until it dies within 0.01 m/s. Below the range hunting is looked for
    down to 1 m/s. `diagram` False: the fold alone.
    """
    track = TangentTrackRuns(model, jobs)
    clearance = model.design.value("contact.flange_clearance")
    grid = np.array(sorted(speeds))
    empty = track.let_go(np.zeros(0), np.zeros((0, track.states)))
    told("putting the vehicle aside at all speeds")
    first = track.settled(track.let_go(grid, track.aside(PUT_ASIDE * clearance)), LARGE * clearance)
    alive = _alive(first, LARGE * clearance)
    fold, hard, above = None, True, empty
    if alive.any():
        lowest = first.select([int(np.flatnonzero(alive)[0])])
        under = grid[grid < lowest.speeds[0]]
        told("following hunting to lower speeds")
        end = _followed(track, lowest, float(under[-1]) if under.size else None, LARGE * clearance)
        hard = _jumps(track, end, LARGE * clearance)
        touching = np.flatnonzero(first.amplitudes[alive] >= clearance)
        if not hard and touching.size:
            last = first.select(alive).select([int(touching[0])])
            end = _followed(track, last, float(end.speeds[0]), clearance)
        fold = float(end.speeds[0]) if hard or touching.size else None
        lowest_shown = end.speeds[0] if hard else DWINDLES * end.speeds[0]
        near = end.speeds[0] + np.concatenate([NEAR, [] if hard else -np.array(NEAR[1:])])
        shown = np.array([*near[near <= grid[-1]], *grid[grid > lowest_shown]])
        start = _nearest(first.select(alive & (first.speeds > end.speeds[0])), end, shown)
        above = track.settled(start, LARGE * clearance if hard else GONE * clearance)
    if not diagram:
        return LimitCycles(fold, hard, above, empty, clearance)
    told("what a small disturbance becomes")
    all_speeds = np.unique([*grid, *above.speeds])
    below = _from_below(track, all_speeds, clearance)
    cycles: list[Cycle] = []
    if hard and len(above) > START:
        told("shooting at the unstable cycle")
        cycles = continue_branch(track, above.select([START]), SMALLEST * clearance, float(grid[-1]))
    return LimitCycles(fold, hard, above, below, clearance, tuple(cycles))


def nonlinear_critical_speeds(models: Sequence[Model], speeds: Sequence[float], jobs: int | None = None) -> FloatArray:
    """The fold [m/s] of each of many vehicles, NaN where none hunts; for searches."""
    found = (find_limit_cycles(with_flange(m)[0], speeds, diagram=False, jobs=jobs).fold for m in models)
    return np.array([np.nan if fold is None else fold for fold in found])


def _from_below(track: TangentTrackRuns, speeds: FloatArray, clearance: float) -> Motion:
    """What becomes of a small disturbance: nothing (amplitude 0), or a steady motion."""
    below = track.settled(track.let_go(speeds, track.aside(NUDGED * clearance)), GONE * clearance, PATIENT)
    dying, now = ~below.steady, below
    for _ in range(WATCHED):  # what only wanders about does not fall for so long
        before, now = now.amplitudes, track.piece(now)
        dying &= now.amplitudes < before
    below.amplitudes[dying | (below.amplitudes < GONE * clearance)] = 0.0
    return below


def _alive(motion: Motion, large: float) -> NDArray[np.bool_]:
    return np.isfinite(motion.amplitudes) & (motion.amplitudes >= large)


def _followed(track: TangentTrackRuns, hunts: Motion, under: float | None, large: float) -> Motion:
    """The steady motion at the lowest speed at which a vehicle that hunts goes on; at `under` it is thought not to."""
    dead = max(SLOWEST, 0.8 * float(hunts.speeds[0])) if under is None else under
    while hunts.speeds[0] > SLOWEST:
        width = float(hunts.speeds[0]) - dead
        # at last the dead end is asked again, from hunting as near to it as can be
        speeds = np.linspace(dead, hunts.speeds[0], LANES + 1)[:-1] if width > CLOSE else np.array([dead])
        found = track.settled(track.let_go(speeds, hunts.states[0]), large)
        alive = np.flatnonzero(_alive(found, large))
        if not alive.size and width <= CLOSE:
            break
        if alive.size:
            hunts = found.select([int(alive[0])])
        below = speeds[speeds < hunts.speeds[0]]
        dead = float(below[-1]) if below.size else max(SLOWEST, dead - 2 * max(width, CLOSE))
    return hunts


def _jumps(track: TangentTrackRuns, end: Motion, large: float) -> bool:
    """Does hunting collapse just below the fold, or does it only dwindle from there on?"""
    below = track.settled(track.let_go(end.speeds - 5 * CLOSE, end.states), 0.9 * large)
    return not bool(np.isfinite(below.amplitudes[0]) and below.amplitudes[0] >= 0.9 * large)


def _nearest(some: Motion, end: Motion, speeds: FloatArray) -> Motion:
    """A start for each speed: the steady motion known at the nearest speed."""
    known, states = np.append(some.speeds, end.speeds), np.vstack([some.states, end.states])
    speeds = np.unique(speeds)
    pick = np.argmin(np.abs(known[None] - speeds[:, None]), axis=1)
    return Motion(speeds, np.ascontiguousarray(states[pick]))
