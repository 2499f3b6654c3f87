"""Ride quality of vehicles on a track at a speed, as `railui ride` computes it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.io.units import read_speed
from railui.ride_quality.comfort import (
    CARBODY_CENTRE,
    HOUR,
    carbody_effect,
    comfort_time,
    floor_points,
    reference_accelerations,
    sperling_wz,
)
from railui.ride_quality.conditions import comfort_notes, duration_findings, duration_notes, guidance_notes
from railui.ride_quality.running_safety import SAFETY_KEYS, RunningSafety, running_safety_many
from railui.ride_quality.score import FRAME_FLOOR, evaluate_ride
from railui.ride_quality.statistics import (
    DECISIVE_STATISTIC,
    SCORE_CHANNELS,
    ride_statistics,
)
from railui.track import Track
from railui.track.excitation import Excitation, TrackSource, resolve_track
from railui.track.line_geometry import GRAVITY, cant_deficiency
from railui.vehicle.grouping import group_by_structure
from railui.vehicle.model import Model
from railui.vehicle.on_track import half_gauges
from railui.vehicle.resolve import ModelSource, require_rating, resolve_model
from railui.vehicle.simulate import simulate_series

TrackLike = Track | TrackSource | str | Path

LINE_NOTE: Final = (
    "line with curves: accelerations contain V^2/R - g cant/(2 b), e is counted on 5 s or more of straights"
)
DEFAULT_CHANNELS: Final = (*SCORE_CHANNELS, "ay1", "ay2", "rf", "d1", "d2", "psi1", "psi2")
WEIGHTED_STATISTICS: Final = ("weighted_acceleration", DECISIVE_STATISTIC, "wz")
STEP_ERROR_TOLERANCE: Final = 1e-4  # relative change by halved steps up to which a ride is taken as exact
MAX_CHECKED_STEPS: Final = 16  # steps per sample up to which halved steps are tried: more resolve any motion smoothly


def excitation_of(track: TrackLike, speed: float | str, seed: int | None = None) -> Excitation:
    """Return a track at a speed, in m/s or a quantity such as "144 km/h"; ValueError for an invalid one of either."""
    return Excitation(resolve_track(track, seed), read_speed(speed) if isinstance(speed, str) else float(speed))


def simulate(
    design: ModelSource, track: TrackLike, speed: float | str, channels: Sequence[str] = DEFAULT_CHANNELS
) -> dict[str, FloatArray]:
    """Simulate a vehicle on a track; it starts at rest.

    Parameters
    ----------
    design, track, speed
        As for `ride`.
    channels : sequence of str
        Names of channels.

    Returns
    -------
    dict of FloatArray
        Arrays [sample] by channel, SI, with t [s] and s [m]; NaN from the sample at which the vehicle diverges.

    Raises
    ------
    ValueError
        For an unknown channel, and as `ride`.

    Examples
    --------
    >>> series = simulate("designs/test_bogie.yaml", "erri_b176_low length=200", 40.0, ["e1"])
    >>> series["e1"].shape, float(series["t"][1])
    ((2000,), 0.0025)
    """
    excitation = excitation_of(track, speed)
    series = _series(resolve_model(design), excitation, channels)
    t = excitation.dt * np.arange(len(excitation.track))
    return {"t": t, "s": excitation.track.s.copy()} | dict(zip(channels, series, strict=True))


def _series(model: Model, excitation: Excitation, channels: Sequence[str]) -> FloatArray:
    """Return series [channel, sample] of one vehicle, NaN from the sample at which it diverges."""
    series, diverged_at = simulate_series(model, excitation, channels)
    if diverged_at is not None:
        series[:, diverged_at:] = np.nan
    return series


def _step_notes(model: Model, excitation: Excitation, statistics: dict[str, FloatArray], jobs: int | None) -> list[str]:
    """Return a note if halved steps change rms displacements or weighted accelerations by more than the tolerance.

    statistics: of the ride with its own steps, as `ride_statistics` returns them.
    """
    steps = int(statistics["steps"][0])
    if steps > MAX_CHECKED_STEPS:
        return []
    halved = ride_statistics(model, model.row[None], excitation, steps=np.array([2 * steps]), jobs=jobs)
    if np.any(statistics["diverged"]) or np.any(halved["diverged"]):
        return []
    changes = {"rms of e": _relative_change(*(np.hypot(each["mean_e"], each["sd_e"]) for each in (statistics, halved)))}
    changes |= {name: _relative_change(statistics[name], halved[name]) for name in WEIGHTED_STATISTICS[:2]}
    worst = max(changes, key=lambda name: changes[name])
    if changes[worst] <= STEP_ERROR_TOLERANCE:
        return []
    change = f"steps: {2 * steps} per sample instead of {steps} change {worst} by {100 * changes[worst]:.2g} %"
    return [f"{change}: stops, clearances or friction need a finer track, or the motion is chaotic"]


def _relative_change(coarse: FloatArray, fine: FloatArray) -> float:
    return float(np.max(np.abs(coarse - fine) / np.maximum(np.abs(fine), np.finfo(float).tiny)))


def simulate_rides(models: Sequence[Model], excitation: Excitation, jobs: int | None = None) -> list[dict[str, Any]]:
    """Return the ride quality of models on one track, in their order; those of one structure share SIMD batches."""
    for model in models:
        require_rating(model.design)
    results: dict[int, dict[str, Any]] = {}
    for members in group_by_structure(models):
        rows = np.stack([models[i].row for i in members])
        statistics = ride_statistics(models[members[0]], rows, excitation, jobs=jobs)
        steps = statistics["steps"].astype(np.int64)
        safety = running_safety_many([models[i] for i in members], excitation, steps, jobs)
        results |= {i: ride_result(models[i], statistics, k, excitation, safety[k]) for k, i in enumerate(members)}
    return [results[i] for i in range(len(models))]


def ride_result(
    model: Model,
    statistics: dict[str, FloatArray],
    number: int,
    excitation: Excitation,
    safety: RunningSafety | None,
) -> dict[str, Any]:
    """Return the ride quality of one of many rides, its statistics, and notes on values that are None.

    safety: guiding forces of the ride; None if it diverged or the track is too short for them.
    """
    own: dict[str, Any] = {name: values[number] for name, values in statistics.items()}
    floors = floor_points(model)
    own["comfort_point"] = _comfort_point(model, floors, own)
    limit = float(own["clearance"])
    findings = [*duration_findings(excitation), *(safety.findings if safety is not None else ())]
    result = evaluate_ride(own, model.design.riding, limit, findings)
    notes = [*excitation.source.notes, *guidance_notes(model, limit), *comfort_notes(model), *result["notes"]]
    result["notes"] = [*notes, *duration_notes(excitation)]
    diverged = bool(own["diverged"])
    result |= dict.fromkeys(SAFETY_KEYS) if safety is None else safety.measures()
    result["forces"] = None if safety is None else safety.as_dict()
    if floors:
        result["floor"] = None if diverged else _floor_results(floors, own)
    result["diverged"] = {"at_s": float(own["lost_at"])} if diverged else None
    displacement = {} if diverged else {name: [float(x) for x in own[name]] for name in ("mean_e", "sd_e")}
    result["statistics"] = displacement | {"samples": len(excitation.track), "duration": excitation.duration}
    result["steps"] = int(own["steps"])
    if excitation.track.has_curves:
        result["line"] = line_summary(model, excitation)
        result["notes"].append(LINE_NOTE)
    source = excitation.source
    return result | {"speed": excitation.speed, "seed": source.seed, "track": source.name}


def line_summary(model: Model, excitation: Excitation) -> dict[str, float | None]:
    """Return the least radius [m] of a line, its largest cant [m] and cant deficiency [m], and their accelerations."""
    track, half_gauge = excitation.track, float(half_gauges(model, model.row[None])[0])
    deficiency = cant_deficiency(track, excitation.speed, half_gauge)
    curvature = float(np.abs(track.curvature).max())
    return {
        "least_radius": 1.0 / curvature if curvature > 0 else None,
        "largest_cant": float(np.abs(track.cant).max()),
        "largest_cant_deficiency": float(deficiency.max()),
        "largest_cant_excess": float(np.maximum(-deficiency, 0.0).max()),
        "largest_acceleration": float(GRAVITY * np.abs(deficiency).max() / (2.0 * half_gauge)),
    }


def _comfort_point(model: Model, floors: Sequence[str], statistics: dict[str, Any]) -> str:
    """Return the name of the comfort point, of several floor points the worst."""
    if floors:
        return f"floor {floors[int(statistics.get('point', 0))]}"
    return FRAME_FLOOR if carbody_effect(model) is None else CARBODY_CENTRE


def _floor_results(floors: Sequence[str], statistics: dict[str, Any]) -> dict[str, dict[str, float]]:
    """Return weighted accelerations, comfort hours and Wz of each floor point."""
    results = {}
    for i, name in enumerate(floors):
        rms = {
            key: float(statistics[f"{key}_points"][i] if len(floors) > 1 else statistics[key])
            for key in WEIGHTED_STATISTICS
        }
        results[name] = {
            "weighted_acceleration": rms["weighted_acceleration"],
            "weighted_acceleration_1974": rms[DECISIVE_STATISTIC],
            "comfort_hours": float(comfort_time(rms[DECISIVE_STATISTIC])) / HOUR,
            "wz": float(sperling_wz(rms["wz"])),
        }
    return results


def ride_many(
    designs: Iterable[ModelSource], track: TrackLike, speed: float | str, jobs: int | None = None
) -> list[dict[str, Any]]:
    """Compute the ride quality of many designs on one track at one speed, in the order given.

    Designs of one structure share SIMD batches; each result is bit-identical to that of the design alone, on any
    number of threads `jobs`.

    Parameters
    ----------
    designs : iterable of Design, Model or path
        Vehicles.
    track, speed, jobs
        As for `ride`.

    Returns
    -------
    list of dict
        Keys as `evaluate_ride`, and `diverged` (None, or the location), `statistics`, `steps` per sample, `speed`,
        `seed`, `track`; `forces`: guiding forces and Y/Q with their limits, see `railui.ride_quality.running_safety`.

    Raises
    ------
    FileProblems, ValueError
        As `ride`.

    Examples
    --------
    >>> results = ride_many(["designs/test_bogie.yaml", "designs/check_bogie.yaml"], "erri_b176_low", 40.0)
    >>> [result["steps"] for result in results]
    [1, 1]
    """
    return simulate_rides([resolve_model(design) for design in designs], excitation_of(track, speed), jobs)


def ride(
    design: ModelSource, track: TrackLike, speed: float | str, *, seed: int | None = None, jobs: int | None = None
) -> dict[str, Any]:
    """Compute the ride quality of a design on a track at a speed.

    Parameters
    ----------
    design : Design, Model or path
        Vehicle.
    track : Track, TrackSource, spec or path
        Track.
    speed : float or str
        Speed [m/s], or a quantity such as "144 km/h".
    seed : int, optional
        Seed that replaces that of the spec.
    jobs : int, optional
        Threads; by default all.

    Returns
    -------
    dict
        Keys as `ride_many`; `reference`: the weighted accelerations computed in the frequency domain, with the brick
        wall of the 1970s, to verify the streaming filters. A note reports if halved steps change the statistics of the
        score by more than 1e-4, because of hard stops or a motion that no step resolves.

    Raises
    ------
    FileProblems
        For faulty files.
    ValueError
        For a faulty spec or speed, or a vehicle too stiff to be integrated.

    References
    ----------
    Broersen 1976, chapter 2.

    Examples
    --------
    >>> ride("designs/test_bogie.yaml", "erri_b176_low length=500", "144 km/h")["decided_by"]
    'reduced comfort after 2.21 h, within the journey of 4 h'
    """
    model, excitation = resolve_model(design), excitation_of(track, speed, seed)
    require_rating(model.design)
    statistics = ride_statistics(model, model.row[None], excitation, jobs=jobs)
    safety = running_safety_many([model], excitation, statistics["steps"].astype(np.int64), jobs)[0]
    result = ride_result(model, statistics, 0, excitation, safety)
    result["notes"] += _step_notes(model, excitation, statistics, jobs)
    if result["diverged"] is not None:
        return result | {"reference": None}
    has_floor = bool(floor_points(model))
    channel = result["comfort_point"].replace("floor ", "floor.", 1) if has_floor else "ayf"
    acceleration = _series(model, excitation, [channel])[0]
    reference = reference_accelerations(model, acceleration, excitation.dt)
    return result | {"reference": reference}
