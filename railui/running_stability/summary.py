"""Stability of a vehicle: modes, linear and nonlinear critical speed, and speed limit by ride criteria."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.progress import SILENT, Progress
from railui.ride_quality.evaluation import TrackLike, simulate_rides
from railui.ride_quality.score import CLASSES
from railui.running_stability.critical_speed import (
    CriticalSpeed,
    critical_speed_sd,
    critical_speeds,
    klingel_wavelength_of,
)
from railui.running_stability.limit_cycles import LimitCycles, find_limit_cycles, with_flange
from railui.running_stability.modes import least_damped_mode, modes_at_speeds
from railui.track.excitation import Excitation, TrackSource, resolve_track
from railui.vehicle.design_reader import Design
from railui.vehicle.linear import linearisation_notes, state_matrices
from railui.vehicle.model import Model
from railui.vehicle.resolve import resolve_model

DEFAULT_SPEEDS: Final = tuple(float(v) for v in range(5, 95, 5))  # m/s
MIN_ADMISSIBLE_CLASS: Final = CLASSES.index("just admissible")
DOWNWARD_STEP: Final = 5.0  # m/s of the search below the range
SPEED_TOLERANCE: Final = 0.1  # m/s of the speed limit by ride criteria


def stability(
    design: Design | Model | str | Path,
    speeds: Sequence[float] = DEFAULT_SPEEDS,
    *,
    fold: bool = False,
    track: TrackLike | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    progress: Progress = SILENT,
) -> dict[str, Any]:
    """Compute modes of a design over speed and its critical speeds.

    Parameters
    ----------
    design : Design, Model or path
        Vehicle.
    speeds : sequence of float
        Speeds [m/s].
    fold : bool
        Compute the nonlinear critical speed and the limit cycles.
    track : Track, TrackSource, spec or path, optional
        Track for the speed limit by ride criteria.
    seed : int, optional
        Seed that replaces that of the spec.
    jobs : int, optional
        Threads; by default all.
    progress : Progress
        Receiver of messages.

    Returns
    -------
    dict
        linear_critical_speed [m/s] and, of estimated parameters, its standard deviation linear_critical_speed_sd,
        linear_critical_frequency [Hz], rest_critical_speed (all effects linearised about
        the state of rest), linear_damping (least ratio over the speeds), linear_damping_mode (that mode),
        klingel_wavelength [m], fold_speed and `fold` (with `fold`: hard or soft loss, amplitude, frequency, bistable
        range, diagram), practical_critical_speed and `practical` (with `track`), modes, notes. None for values that
        were not requested, and for critical speeds beyond the range.

    Raises
    ------
    FileProblems
        For a faulty file.
    ValueError
        For speeds that are not positive, and for a state matrix that is not finite.

    References
    ----------
    Broersen 1976, 2.1.

    Examples
    --------
    >>> result = stability("designs/check_bogie.yaml", [20.0, 80.0])
    >>> round(result["linear_critical_speed"], 5), result["fold_speed"]
    (61.64024, None)
    """
    model = resolve_model(design)
    grid = sorted(float(v) for v in speeds)
    if not grid or not grid[0] > 0 or not np.isfinite(grid[-1]):
        raise ValueError(f"speeds must be positive, at least one of them: {list(speeds)}")
    rows = model.row[None]
    _check_finite(model, grid)
    linear = critical_speeds(model, rows, grid[-1])[0]
    rest = critical_speeds(model, rows, grid[-1], at_rest=True)[0] if model.effects else linear
    modes = modes_at_speeds(model, grid)
    least_damped = least_damped_mode(modes)
    notes = _linear_notes(model, linear, rest, grid[-1])
    result: dict[str, Any] = {
        "linear_critical_speed": None if linear is None else linear.speed,
        "linear_critical_speed_sd": critical_speed_sd(model, 2.0 * grid[-1]) if linear else None,
        "linear_critical_frequency": None if linear is None else linear.frequency,
        "rest_critical_speed": None if rest is None else rest.speed,
        "linear_damping": np.inf if least_damped is None else least_damped["damping"],
        "linear_damping_mode": least_damped,
        "klingel_wavelength": klingel_wavelength_of(model, model.row),
        "fold_speed": None,
        "fold": None,
        "practical_critical_speed": None,
        "practical": None,
    }
    if fold:
        with_contact, flange_notes = with_flange(model)
        cycles = find_limit_cycles(with_contact, grid, jobs=jobs, progress=progress)
        summary = limit_cycle_summary(cycles, result["rest_critical_speed"])
        result |= {"fold_speed": cycles.critical_speed, "fold": summary}
        notes += [*flange_notes, *_fold_notes(cycles, grid[-1])]
    if track is not None:
        practical = practical_critical_speed(model, resolve_track(track, seed), grid, jobs, progress)
        result |= {"practical_critical_speed": practical["speed"], "practical": practical}
        notes += practical.pop("notes")
    return result | {"speeds": grid, "modes": modes, "notes": notes}


def _check_finite(model: Model, speeds: Sequence[float]) -> None:
    """Raise ValueError for a vehicle whose state matrix is not finite."""
    matrices = state_matrices(model, np.repeat(model.row[None], len(speeds), axis=0), np.asarray(speeds))
    if not np.isfinite(matrices).all():
        raise ValueError("the state matrix of this vehicle is not finite: give its masses and inertias usual values")


def _linear_notes(model: Model, linear: CriticalSpeed | None, rest: CriticalSpeed | None, highest: float) -> list[str]:
    """Return notes on effects that the linear analysis omits and on critical speeds that are None or 0."""
    notes = linearisation_notes(model, ", whose slopes at rest are in rest_critical_speed")
    for key, critical in (("linear_critical_speed", linear), ("rest_critical_speed", rest)):
        if critical is None:
            notes.append(f"{key}: none up to {highest:.4g} m/s")
        elif not critical.speed:
            notes.append(f"{key}: 0, unstable at every speed from 1 m/s")
    return notes


def _fold_notes(cycles: LimitCycles, highest: float) -> list[str]:
    if cycles.critical_speed is None:
        return [f"fold_speed: none, no steady hunting from flange to flange up to {highest:.4g} m/s"]
    if not cycles.is_subcritical:
        return ["fold_speed: below it hunting no longer reaches the flanges; its amplitude decreases without a jump"]
    return []


def limit_cycle_summary(cycles: LimitCycles, rest: float | None) -> dict[str, Any]:
    """Return the value of the result key `fold`.

    loss (hard or soft), amplitude [m] and frequency [Hz] at the critical speed, bistable range [m/s] up to `rest`
    (None: beyond the range), the critical speed about the state of rest, clearance [m], diagram and branch.
    """
    critical, above = cycles.critical_speed, cycles.from_above
    lowest: dict[str, float | None] = {"amplitude": None, "frequency": None}
    loss, bistable = None, None
    if critical is not None:
        k = int(np.argmin(np.abs(above.speeds - critical)))
        lowest = {"amplitude": float(above.amplitudes[k]), "frequency": float(above.frequencies[k])}
        loss = "hard" if cycles.is_subcritical else "soft"
        if cycles.is_subcritical and (rest is None or rest > critical):
            bistable = [critical, rest]
    return {
        "loss": loss,
        **lowest,
        "bistable": bistable,
        "clearance": cycles.clearance,
        "diagram": cycles.rows(),
        "branch": [cycle.as_dict() for cycle in cycles.branch],
    }


def practical_critical_speed(
    model: Model,
    track: TrackSource,
    speeds: Sequence[float],
    jobs: int | None = None,
    progress: Progress = SILENT,
) -> dict[str, Any]:
    """Compute the speed limit by ride criteria: the highest speed up to which the class is at least just admissible.

    The class is that of `railui ride` on this track. The search runs upward over the speeds, from the first of them
    downward by 5 m/s if that is inadmissible, then bisects to 0.1 m/s between the last admissible and the first
    inadmissible one.

    Parameters
    ----------
    model : Model
        Vehicle.
    track : TrackSource
        Track.
    speeds : sequence of float
        Speeds [m/s], increasing.
    jobs, progress
        As for `stability`.

    Returns
    -------
    dict
        speed [m/s] (None if all speeds are admissible, or none is), track, decided_by (None if all speeds are
        admissible), rides, notes.

    References
    ----------
    Broersen 1976, chapter 2.
    """
    rides: list[dict[str, Any]] = []

    def is_admissible(v: float) -> bool:
        progress.message(f"simulating {track.name} at {v:.4g} m/s")
        ride = simulate_rides([model], Excitation(track, v), jobs)[0]
        rides.append({key: ride[key] for key in ("speed", "score", "class", "decided_by", "flange_fraction")})
        return CLASSES.index(ride["class"]) >= MIN_ADMISSIBLE_CLASS

    admissible, inadmissible = 0.0, None
    for v in speeds:
        if not is_admissible(v):
            inadmissible = v
            break
        admissible = v
    while inadmissible is not None and not admissible and inadmissible > DOWNWARD_STEP:
        lower = inadmissible - DOWNWARD_STEP
        if is_admissible(lower):
            admissible = lower
        else:
            inadmissible = lower
    speed: float | None = None
    notes = []
    if inadmissible is None:
        notes.append(f"practical_critical_speed: none, the class is admissible up to {admissible:.4g} m/s")
    elif not admissible:
        notes.append(f"practical_critical_speed: null, not admissible at {inadmissible:.4g} m/s")
    else:
        if admissible < speeds[0]:
            notes.append(f"practical_critical_speed: below the range of speeds, not admissible at {speeds[0]:.4g} m/s")
        while inadmissible - admissible > SPEED_TOLERANCE:
            middle = 0.5 * (admissible + inadmissible)
            if is_admissible(middle):
                admissible = middle
            else:
                inadmissible = middle
        speed = admissible
    rides.sort(key=lambda ride: ride["speed"])
    decisive = next((ride for ride in rides if ride["speed"] == inadmissible), None)
    reason = None if decisive is None else decisive["decided_by"]
    return {"speed": speed, "track": track.name, "decided_by": reason, "rides": rides, "notes": notes}
