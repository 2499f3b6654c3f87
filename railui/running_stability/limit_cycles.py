"""Limit cycles with flange contact over speed, the nonlinear critical speed, and the disturbances that start them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.progress import SILENT, Progress
from railui.running_stability.continuation import Cycle, continue_branch
from railui.running_stability.critical_speed import MIN_SPEED
from railui.running_stability.tangent_track import Motion, TangentTrackRuns
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model

SPEEDS_PER_SEARCH: Final = 16  # one SIMD batch
SPEED_TOLERANCE: Final = 0.01  # m/s of the nonlinear critical speed
# amplitudes as shares of the flange clearance
HUNTING_AMPLITUDE: Final = 0.5  # from which a motion counts as hunting between the flanges
DECAYED_AMPLITUDE: Final = 1e-3  # below which a motion has decayed
LARGE_OFFSET: Final = 1.5  # initial lateral offset that starts hunting wherever it is possible
SMALL_OFFSET: Final = 0.02  # initial lateral offset of a disturbance that occurs on every track
MIN_BRANCH_AMPLITUDE: Final = 0.03  # down to which the unstable cycle is continued
MAX_GROWTH_DISTANCE: Final = 100e3  # m along which a small disturbance may grow
DECAY_SEGMENTS: Final = 8  # consecutive segments of track with falling amplitude of a slowly decaying motion
MIN_SHOWN_SPEED: Final = 0.7  # of the critical speed, down to which decreasing hunting is shown
START_INDEX: Final = 3  # of the speeds above the critical speed, where shooting begins
DENSE_OFFSETS: Final = (0.0, 0.02, 0.1, 0.3, 0.7, 1.5)  # m/s above the critical speed, where the branch is steep


def with_flange(model: Model) -> tuple[Model, list[str]]:
    """Return the vehicle with flange contact, added if its design has none, and notes on missing effects."""
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

    Attributes
    ----------
    critical_speed : float or None
        Nonlinear critical speed [m/s], below which hunting decays; None without hunting.
    is_subcritical : bool
        True if hunting collapses there (saddle-node of limit cycles); else its amplitude decreases gradually, and the
        critical speed is where it no longer reaches the flanges.
    from_above : Motion
        Steady motion at the speeds above the critical speed.
    from_below : Motion
        Steady motion that follows from a small disturbance.
    clearance : float
        Flange clearance [m].
    branch : tuple of Cycle
        Cycles continued by shooting, first stable, then unstable.
    """

    critical_speed: float | None
    is_subcritical: bool
    from_above: Motion
    from_below: Motion
    clearance: float
    branch: tuple[Cycle, ...] = ()

    def rows(self) -> list[dict[str, Any]]:
        """Return one row per speed: amplitude from_above and from_below [m] and the frequency of hunting [Hz]."""
        above, below = _by_speed(self.from_above), _by_speed(self.from_below)
        rows = []
        for v in sorted({*above, *below}):
            large, small = above.get(v), below.get(v)
            rows.append(
                {
                    "speed": v,
                    "from_above": None if large is None else large[0],
                    "from_below": None if small is None else small[0],
                    "frequency": None if large is None else large[1],
                }
            )
        return rows


def _by_speed(motion: Motion) -> dict[float, tuple[float, float]]:
    """Return amplitude [m] and frequency [Hz] by speed [m/s]."""
    rows = zip(motion.speeds, motion.amplitudes, motion.frequencies, strict=True)
    return {float(v): (float(a), float(f)) for v, a, f in rows}


def find_limit_cycles(
    model: Model,
    speeds: Sequence[float],
    *,
    diagram: bool = True,
    jobs: int | None = None,
    progress: Progress = SILENT,
) -> LimitCycles:
    """Compute the hunting of a vehicle over speed.

    The vehicle starts with a large lateral offset at all speeds. Where it keeps hunting between the flanges, that
    motion is continued to lower speeds, sixteen at a time, until it decays, to within 0.01 m/s; below the given range
    down to 1 m/s.

    Parameters
    ----------
    model : Model
        Vehicle with flange contact, see `with_flange`.
    speeds : sequence of float
        Speeds [m/s].
    diagram : bool
        Also compute motions from small disturbances and the unstable branch; else the critical speed alone.
    jobs : int, optional
        Threads; by default all.
    progress : Progress
        Receiver of messages.
    """
    runs = TangentTrackRuns(model, jobs)
    clearance = model.design.value("contact.flange_clearance")
    hunting = HUNTING_AMPLITUDE * clearance
    grid = np.array(sorted(speeds))
    nothing = runs.start(np.zeros(0), np.zeros((0, runs.states)))
    progress.message("starting with a large lateral offset at all speeds")
    first = runs.settle(runs.start(grid, runs.displaced_state(LARGE_OFFSET * clearance)), hunting)
    is_hunting = _is_hunting(first, hunting)
    critical, is_subcritical, above = None, True, nothing
    if is_hunting.any():
        progress.message("following hunting to lower speeds")
        critical, is_subcritical, end = _nonlinear_critical_speed(runs, first, is_hunting, clearance)
        shown = _shown_speeds(grid, float(end.speeds[0]), is_subcritical)
        start = _nearest_motions(first.select(is_hunting & (first.speeds > end.speeds[0])), end, shown)
        above = runs.settle(start, hunting if is_subcritical else DECAYED_AMPLITUDE * clearance)
    if not diagram:
        return LimitCycles(critical, is_subcritical, above, nothing, clearance)
    progress.message("simulating small disturbances")
    below = _motions_from_small_offset(runs, np.unique([*grid, *above.speeds]), clearance)
    branch: list[Cycle] = []
    if is_subcritical and len(above) > START_INDEX:
        progress.message("continuing the unstable limit cycle")
        start = above.select([START_INDEX])
        branch = continue_branch(runs, start, MIN_BRANCH_AMPLITUDE * clearance, float(grid[-1]))
    return LimitCycles(critical, is_subcritical, above, below, clearance, tuple(branch))


def nonlinear_critical_speeds(models: Sequence[Model], speeds: Sequence[float], jobs: int | None = None) -> FloatArray:
    """Return the nonlinear critical speed [m/s] of each of many vehicles, NaN without hunting."""
    cycles = (find_limit_cycles(with_flange(m)[0], speeds, diagram=False, jobs=jobs) for m in models)
    return np.array([np.nan if c.critical_speed is None else c.critical_speed for c in cycles])


def _nonlinear_critical_speed(
    runs: TangentTrackRuns, first: Motion, is_hunting: NDArray[np.bool_], clearance: float
) -> tuple[float | None, bool, Motion]:
    """Return the critical speed, whether hunting collapses there, and the slowest hunting motion."""
    hunting = HUNTING_AMPLITUDE * clearance
    slowest = first.select([int(np.flatnonzero(is_hunting)[0])])
    slower = first.speeds[first.speeds < slowest.speeds[0]]
    end = _slowest_hunting(runs, slowest, float(slower[-1]) if slower.size else None, hunting)
    if _collapses(runs, end, hunting):
        return float(end.speeds[0]), True, end
    touching = np.flatnonzero(first.amplitudes[is_hunting] >= clearance)
    if not touching.size:
        return None, False, end
    slowest = first.select(is_hunting).select([int(touching[0])])
    end = _slowest_hunting(runs, slowest, float(end.speeds[0]), clearance)
    return float(end.speeds[0]), False, end


def _shown_speeds(grid: FloatArray, end: float, is_subcritical: bool) -> FloatArray:
    """Return the speeds at which hunting is shown: the grid above the lowest, and dense speeds near `end` [m/s]."""
    lowest = end if is_subcritical else MIN_SHOWN_SPEED * end
    dense = end + np.concatenate([DENSE_OFFSETS, [] if is_subcritical else -np.array(DENSE_OFFSETS[1:])])
    return np.array([*dense[dense <= grid[-1]], *grid[grid > lowest]])


def _motions_from_small_offset(runs: TangentTrackRuns, speeds: FloatArray, clearance: float) -> Motion:
    """Return the motions that follow from a small disturbance: decayed (amplitude 0), or steady."""
    decayed = DECAYED_AMPLITUDE * clearance
    start = runs.start(speeds, runs.displaced_state(SMALL_OFFSET * clearance))
    below = runs.settle(start, decayed, MAX_GROWTH_DISTANCE)
    is_decaying, now = ~below.is_steady, below
    for _ in range(DECAY_SEGMENTS):  # the amplitude of a chaotic motion does not fall for so long
        before, now = now.amplitudes, runs.advance(now)
        is_decaying &= now.amplitudes < before
    below.amplitudes[is_decaying | (below.amplitudes < decayed)] = 0.0
    return below


def _is_hunting(motion: Motion, amplitude: float) -> NDArray[np.bool_]:
    return np.isfinite(motion.amplitudes) & (motion.amplitudes >= amplitude)


def _slowest_hunting(runs: TangentTrackRuns, motion: Motion, below: float | None, amplitude: float) -> Motion:
    """Return the steady motion at the lowest speed of hunting; at `below` [m/s] it is assumed to decay."""
    lower = max(MIN_SPEED, 0.8 * float(motion.speeds[0])) if below is None else below
    while motion.speeds[0] > MIN_SPEED:
        width = float(motion.speeds[0]) - lower
        # at the end the lower speed is tried again, from hunting as near to it as possible
        is_narrow = width <= SPEED_TOLERANCE
        count = SPEEDS_PER_SEARCH + 1
        speeds = np.array([lower]) if is_narrow else np.linspace(lower, motion.speeds[0], count)[:-1]
        motions = runs.settle(runs.start(speeds, motion.states[0]), amplitude)
        hunting = np.flatnonzero(_is_hunting(motions, amplitude))
        if not hunting.size and is_narrow:
            break
        if hunting.size:
            motion = motions.select([int(hunting[0])])
        slower = speeds[speeds < motion.speeds[0]]
        lower = float(slower[-1]) if slower.size else max(MIN_SPEED, lower - 2 * max(width, SPEED_TOLERANCE))
    return motion


def _collapses(runs: TangentTrackRuns, end: Motion, amplitude: float) -> bool:
    """Return True if hunting collapses just below its lowest speed instead of decreasing gradually."""
    below = runs.settle(runs.start(end.speeds - 5 * SPEED_TOLERANCE, end.states), 0.9 * amplitude)
    return not bool(_is_hunting(below, 0.9 * amplitude)[0])


def _nearest_motions(motions: Motion, end: Motion, speeds: FloatArray) -> Motion:
    """Return an initial state for each speed: the steady motion at the nearest known speed."""
    known, states = np.append(motions.speeds, end.speeds), np.vstack([motions.states, end.states])
    speeds = np.unique(speeds)
    pick = np.argmin(np.abs(known[None] - speeds[:, None]), axis=1)
    return Motion(speeds, np.ascontiguousarray(states[pick]))
