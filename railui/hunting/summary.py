"""Stability of a vehicle: modes, linear critical speed, the fold, and the critical speed in practice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.hunting.critical_speed import critical_speeds, klingel_of
from railui.hunting.limit_cycles import LimitCycles, find_limit_cycles, with_flange
from railui.hunting.modes import modes_over
from railui.ride_quality.evaluation import TrackGiven, simulate_rides
from railui.ride_quality.score import CLASSES
from railui.track.excitation import Excitation, TrackSource, resolve_track
from railui.vehicle.design_reader import Design
from railui.vehicle.linear import linear_effects, state_matrices
from railui.vehicle.model import Model
from railui.vehicle.resolve import model_of

SPEEDS: Final = tuple(float(v) for v in range(5, 95, 5))  # m/s
ADMISSIBLE: Final = CLASSES.index("just admissible")
CLOSE: Final = 0.1  # m/s of the critical speed in practice

Told = Callable[[str], None]


def stability(
    design: Design | Model | str | Path,
    speeds: Sequence[float] = SPEEDS,
    *,
    fold: bool = False,
    track: TrackGiven | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    told: Told = lambda _: None,
) -> dict[str, Any]:
    """Modes of a design over speeds [m/s] and its critical speeds; None where not asked for or none in the range.

    Keys: linear_critical_speed [m/s], linear_critical_frequency [Hz], rest_critical_speed (with the slopes of
    all effects at rest), linear_damping (least ratio over the speeds), klingel_wavelength [m], fold_speed,
    `fold` (with `fold`: hard or soft, amplitude, frequency, bistable, diagram), practical_critical_speed and
    `practical` (with `track`), modes, notes. Raises FileProblems, ValueError for speeds that cannot be.
    Source: Broersen 1976, 2.1.

    >>> found = stability("designs/check_bogie.yaml", [20.0, 80.0])
    >>> round(found["linear_critical_speed"], 5), found["fold_speed"]
    (61.64024, None)
    """
    model = model_of(design)
    grid = sorted(float(v) for v in speeds)
    if not grid or not grid[0] > 0 or not np.isfinite(grid[-1]):
        raise ValueError(f"speeds must be positive, at least one of them: {list(speeds)}")
    rows, notes = model.row[None], []
    _check_finite(model, grid)
    linear = critical_speeds(model, rows, grid[-1])[0]
    rest = critical_speeds(model, rows, grid[-1], at_rest=True)[0] if model.effects else linear
    modes = modes_over(model, grid)
    left_out = sorted({e.kind for e, yes in zip(model.effects, linear_effects(model), strict=True) if not yes})
    if left_out:
        notes.append(f"linear: without {', '.join(left_out)}, whose slopes at rest are in rest_critical_speed")
    for key, found in (("linear_critical_speed", linear), ("rest_critical_speed", rest)):
        notes += [f"{key}: none up to {grid[-1]:g} m/s"] if found is None else []
        notes += [f"{key}: 0, unstable at every speed from 1 m/s"] if found is not None and not found.speed else []
    body: dict[str, Any] = {
        "linear_critical_speed": None if linear is None else linear.speed,
        "linear_critical_frequency": None if linear is None else linear.frequency,
        "rest_critical_speed": None if rest is None else rest.speed,
        "linear_damping": min(mode["damping"] for mode in modes),
        "klingel_wavelength": klingel_of(model, model.row),
        "fold_speed": None,
        "fold": None,
        "practical_critical_speed": None,
        "practical": None,
    }
    if fold:
        with_contact, more = with_flange(model)
        cycle = find_limit_cycles(with_contact, grid, jobs=jobs, told=told)
        body |= {"fold_speed": cycle.fold, "fold": nonlinear_critical_speed(cycle, body["rest_critical_speed"])}
        notes += more if cycle.fold is not None else [*more, f"fold_speed: none, nothing hunts up to {grid[-1]:g} m/s"]
        if cycle.fold is not None and not cycle.hard:
            notes.append("fold_speed: below it hunting no longer reaches the flanges; it dwindles, without a jump")
    if track is not None:
        found_practical = practical_critical_speed(model, resolve_track(track, seed), grid, jobs, told)
        body |= {"practical_critical_speed": found_practical["speed"], "practical": found_practical}
        notes += found_practical.pop("notes")
    return body | {"speeds": grid, "modes": modes, "notes": notes}


def _check_finite(model: Model, speeds: Sequence[float]) -> None:
    matrices = state_matrices(model, np.repeat(model.row[None], len(speeds), axis=0), np.asarray(speeds))
    if not np.isfinite(matrices).all():
        raise ValueError("the state matrix of this vehicle is not finite: give its masses and inertias usual values")


def nonlinear_critical_speed(cycle: LimitCycles, rest: float | None) -> dict[str, Any]:
    """What is told of the fold: how hunting dies there, and the band in which it and rest are both stable."""
    lowest: dict[str, float | None] = {"amplitude": None, "frequency": None}
    if cycle.fold is not None:
        k = int(np.argmin(np.abs(cycle.from_above.speeds - cycle.fold)))
        lowest["amplitude"] = float(cycle.from_above.amplitudes[k])
        lowest["frequency"] = float(cycle.from_above.frequencies[k])
    band = None
    if cycle.fold is not None and cycle.hard and (rest is None or rest > cycle.fold):
        band = [cycle.fold, rest]
    kind = None if cycle.fold is None else "hard" if cycle.hard else "soft"
    return {
        "loss": kind,
        **lowest,
        "bistable": band,
        "clearance": cycle.clearance,
        "diagram": cycle.rows(),
        "branch": [one.as_dict() for one in cycle.branch],
    }


def practical_critical_speed(
    model: Model, track: TrackSource, speeds: Sequence[float], jobs: int | None = None, told: Told = lambda _: None
) -> dict[str, Any]:
    """The critical speed in practice: the highest speed [m/s] up to which the class stays just admissible.

    The class is that of `railui ride` on this track. Looked for upwards over the speeds, then by bisection to
    0.1 m/s between the last that is admissible and the first that is not. speed is None where all are
    admissible, 0 where none is. Source: Broersen 1976, chapter 2.
    """
    tried: list[dict[str, Any]] = []

    def admissible(v: float) -> bool:
        told(f"riding {track.name} at {v:.4g} m/s")
        found = simulate_rides([model], Excitation(track, v), jobs)[0]
        tried.append({key: found[key] for key in ("speed", "score", "class", "decided_by", "flange_fraction")})
        return CLASSES.index(found["class"]) >= ADMISSIBLE

    good, bad = 0.0, None
    for v in speeds:
        if not admissible(v):
            bad = v
            break
        good = v
    speed: float | None = None
    notes = []
    if bad is None:
        notes.append(f"practical_critical_speed: none, the class is admissible up to {good:g} m/s")
    else:
        while good and bad - good > CLOSE:
            middle = 0.5 * (good + bad)
            good, bad = (middle, bad) if admissible(middle) else (good, middle)
        speed = good
        if not good:
            notes.append(f"practical_critical_speed: 0, not admissible at {speeds[0]:g} m/s already")
    tried.sort(key=lambda one: one["speed"])
    ends = next((one for one in tried if bad is not None and one["speed"] == bad), None)
    decided = None if ends is None else ends["decided_by"]
    return {"speed": speed, "track": track.name, "decided_by": decided, "rides": tried, "notes": notes}
