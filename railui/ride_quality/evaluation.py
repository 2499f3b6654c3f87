"""Riding quality of vehicles on a track at a speed: what is asked of `railui ride`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.io.units import read_speed
from railui.ride_quality.comfort import COACH, HOUR, carbody_of, comfort_time, floor_points, reference, ride_value
from railui.ride_quality.running_safety import running_safety
from railui.ride_quality.score import FLOOR_OF_FRAME, riding_quality
from railui.ride_quality.statistics import JUDGED_BY, SCORED, guided_by_force, statistics_many
from railui.track import Track
from railui.track.excitation import Excitation, TrackSource, resolve_track
from railui.vehicle.grouping import by_structure
from railui.vehicle.model import Model
from railui.vehicle.resolve import Given, model_of
from railui.vehicle.simulate import simulate_series

TrackGiven = Track | TrackSource | str | Path

CHANNELS: Final = (*SCORED, "ay1", "ay2", "rf", "d1", "d2", "psi1", "psi2")
WEIGHTED: Final = ("weighted_acceleration", JUDGED_BY, "wz")
RESOLVED: Final = 1e-4  # change by halved steps below which a ride is taken as exact
LOOKED_AT: Final = 16  # steps per sample up to which that is looked at: where more are taken a motion is smooth in them


def excitation_of(track: TrackGiven, speed: float | str, seed: int | None = None) -> Excitation:
    """A track at a speed: m/s, or a quantity such as "144 km/h"; ValueError where either cannot be."""
    return Excitation(resolve_track(track, seed), read_speed(speed) if isinstance(speed, str) else float(speed))


def simulate(
    design: Given, track: TrackGiven, speed: float | str, channels: Sequence[str] = CHANNELS
) -> dict[str, FloatArray]:
    """Arrays by channel name [samples], SI, with t [s] and s [m]; the vehicle starts at rest.

    A vehicle that diverges is NaN from there on. Raises ValueError for an unknown channel, and as `ride`.

    >>> found = simulate("designs/test_bogie.yaml", "erri_b176_low length=200", 40.0, ["e1"])
    >>> found["e1"].shape, float(found["t"][1])
    ((2000,), 0.0025)
    """
    road = excitation_of(track, speed)
    series = _series(model_of(design), road, channels)
    t = road.dt * np.arange(len(road.track))
    return {"t": t, "s": road.track.s.copy()} | dict(zip(channels, series, strict=True))


def _series(model: Model, road: Excitation, channels: Sequence[str]) -> FloatArray:
    """Series [channel, sample] of one vehicle, NaN from where it diverges."""
    series, lost = simulate_series(model, road, channels)
    if lost is not None:
        series[:, lost:] = np.nan
    return series


def _unresolved(model: Model, road: Excitation, coarse: dict[str, FloatArray], jobs: int | None) -> list[str]:
    """A note where halved steps change rms displacements or weighted accelerations of a ride by more than `RESOLVED`.

    coarse: its statistics as `statistics_many` gives them.
    """
    steps = int(coarse["steps"][0])
    if steps > LOOKED_AT:
        return []
    fine = statistics_many(model, model.row[None], road, steps=np.array([2 * steps]), jobs=jobs)
    if np.any(coarse["diverged"]) or np.any(fine["diverged"]):
        return []
    changes = {"rms of e": _change(*(np.hypot(one["mean_e"], one["sd_e"]) for one in (coarse, fine)))}
    changes |= {name: _change(coarse[name], fine[name]) for name in WEIGHTED[:2]}
    worst = max(changes, key=lambda name: changes[name])
    if changes[worst] <= RESOLVED:
        return []
    told = f"steps: {2 * steps} per sample instead of {steps} change {worst} by {100 * changes[worst]:.2g} %"
    return [f"{told}: what is hard there (stops, play, friction) needs a finer track, or moves too wildly for any"]


def _change(coarse: FloatArray, fine: FloatArray) -> float:
    """The greatest relative change."""
    return float(np.max(np.abs(coarse - fine) / np.maximum(np.abs(fine), np.finfo(float).tiny)))


def simulate_rides(models: Sequence[Model], road: Excitation, jobs: int | None = None) -> list[dict[str, Any]]:
    """The riding quality of models on a road, in their order; those of one structure side by side."""
    found: dict[int, dict[str, Any]] = {}
    for members in by_structure(models):
        rows = np.stack([models[i].row for i in members])
        statistics = statistics_many(models[members[0]], rows, road, jobs=jobs)
        found |= {i: quality_of(models[i], statistics, k, road) for k, i in enumerate(members)}
    return [found[i] for i in range(len(models))]


def quality_of(model: Model, statistics: dict[str, FloatArray], i: int, road: Excitation) -> dict[str, Any]:
    """The riding quality of one of many rides and what it rests on; notes say why a value is None."""
    one: dict[str, Any] = {name: values[i] for name, values in statistics.items()}
    names = floor_points(model)
    point = int(one["point"]) if "point" in one else 0
    one["comfort_point"] = f"floor {names[point]}" if names else FLOOR_OF_FRAME if carbody_of(model) is None else COACH
    clearance, notes = float(one["clearance"]), list(road.laid.notes)
    if guided_by_force(model):
        notes.append(
            f"guidance: flange_* count the sum of guiding forces against {clearance:.5g} N, not flange contact"
        )
    elif model.design.gauge_widens_clearance:
        clearance += float(road.track.gauge.mean()) / 2
        notes.append("clearance: widened by half the gauge, of which flange_margin takes mean and spread")
    if carbody_of(model) is not None and sum(e.at == "secondary_lateral" for e in model.design.effects) > 1:
        notes.append("comfort: what other effects at secondary_lateral do to the coach itself is left out")
    found = riding_quality(one, model.design.riding, clearance)
    found["notes"] += notes
    lost = bool(one["diverged"])
    if names:
        found["floor"] = None if lost else floor_of_points(names, one)
    found["diverged"] = {"at_s": float(one["lost_at"])} if lost else None
    spread = {} if lost else {name: [float(x) for x in one[name]] for name in ("mean_e", "sd_e")}
    found["statistics"] = spread | {"samples": len(road.track), "duration": road.duration}
    found["steps"] = int(one["steps"])
    return found | {"speed": road.speed, "seed": road.laid.seed, "track": road.laid.name}


def floor_of_points(names: Sequence[str], one: dict[str, Any]) -> dict[str, dict[str, float]]:
    """What each floor point feels: weighted accelerations, comfort hours and Wz."""
    found = {}
    for i, name in enumerate(names):
        felt = {key: float(one[f"{key}_points"][i] if len(names) > 1 else one[key]) for key in WEIGHTED}
        found[name] = {
            "weighted_acceleration": felt["weighted_acceleration"],
            "weighted_acceleration_1974": felt[JUDGED_BY],
            "comfort_hours": float(comfort_time(felt[JUDGED_BY])) / HOUR,
            "wz": float(ride_value(felt["wz"])),
        }
    return found


def ride_many(
    designs: Iterable[Given], track: TrackGiven, speed: float | str, jobs: int | None = None
) -> list[dict[str, Any]]:
    """The riding quality of many designs on one track at one speed [m/s], in the order given.

    Designs of one structure ride side by side; each result is the same to the last digit as alone, on any
    number of threads `jobs`. Keys as `riding_quality`, and `diverged` (None, or where), `statistics`,
    `steps` per sample, `speed`, `seed`, `track`. Raises FileProblems, ValueError as `ride`.

    >>> found = ride_many(["designs/test_bogie.yaml", "designs/check_bogie.yaml"], "erri_b176_low", 40.0)
    >>> [one["steps"] for one in found]
    [1, 1]
    """
    return simulate_rides([model_of(design) for design in designs], excitation_of(track, speed), jobs)


def ride(
    design: Given, track: TrackGiven, speed: float | str, *, seed: int | None = None, jobs: int | None = None
) -> dict[str, Any]:
    """The riding quality of a design (or its file) on a track (or its spec or file) at a speed [m/s].

    As `ride_many`, and `reference`: the weighted accelerations in the frequency domain, with the brick wall
    of the 1970s, beside which the streaming forms of the result stand. `seed` takes the place of the
    spec's. A note tells where halved steps change what the score rests on by more than 1e-4: hard stops, or a
    motion that no step can follow. `forces`: guiding forces and Y/Q by the names of EN 14363, see
    `railui.ride_quality.running_safety`. Raises FileProblems for faulty files, ValueError for a faulty spec or
    speed, or a vehicle too stiff to be stepped. Source: Broersen 1976, chapter 2.

    >>> ride("designs/test_bogie.yaml", "erri_b176_low length=500", "144 km/h")["decided_by"]
    'reduced comfort after 2.21 h, within the journey of 4 h'
    """
    model, road = model_of(design), excitation_of(track, speed, seed)
    statistics = statistics_many(model, model.row[None], road, jobs=jobs)
    found = quality_of(model, statistics, 0, road)
    found["notes"] += _unresolved(model, road, statistics, jobs)
    if found["diverged"] is None:
        names = floor_points(model)
        channel = found["comfort_point"].replace("floor ", "floor.", 1) if names else "ayf"
        acceleration = _series(model, road, [channel])[0]
        told = running_safety(model, road)
        return found | {"reference": reference(model, acceleration, road.dt), "forces": told}
    return found | {"reference": None, "forces": None}
