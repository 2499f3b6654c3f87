"""Evaluation of recordings by the rules of EN 14363: estimated maxima of each test zone against their limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.ride_quality.en14363.completeness import missing_parts
from railui.ride_quality.en14363.estimation import (
    CONFIDENCE,
    FACTORS,
    Estimate,
    estimate_one_dimensional,
    estimate_two_dimensional,
)
from railui.ride_quality.en14363.quantities import Signal, VehicleData, signals_of
from railui.ride_quality.en14363.recording import (
    Recording,
    read_recording,
    simulate_recording,
)
from railui.ride_quality.en14363.zones import ZONES, Section, Zone, cut_sections
from railui.ride_quality.evaluation import TrackLike, excitation_of
from railui.ride_quality.guiding_forces import wheel_load_paths
from railui.ride_quality.running_safety import model_notes
from railui.vehicle.model import Model
from railui.vehicle.multibody import bogie_masses
from railui.vehicle.on_track import half_gauges
from railui.vehicle.resolve import ModelSource, resolve_model

KEPT, EXCEEDED, INCOMPLETE = "lateral limits met", "limit exceeded", "incomplete"
DISCLAIMER: Final = "an evaluation by the rules of EN 14363, not an acceptance: see docs/en14363.md for their sources"
SPEED_PERCENTILE: Final = 99.0  # of the speed, which selects the length of the sections
STRAIGHT_NOTE: Final = "simulated: the track is straight, test zones 2 to 4 are missing"
LATERAL_NOTE: Final = "vertical quantities (Q, vertical accelerations) are not evaluated: the limits are lateral"

Sample = tuple[Zone, str, str]  # zone, quantity, place


@dataclass
class _Values:
    """Statistical sample of a quantity at a place in a zone."""

    signal: Signal
    values: list[float] = field(default_factory=list)
    cant_deficiencies: list[float] = field(default_factory=list)


def evaluate_simulated(
    track: TrackLike,
    design: ModelSource,
    speed: float | str,
    *,
    cant_deficiency: float | None = None,
    seed: int | None = None,
    jobs: int | None = 1,
) -> dict[str, Any]:
    """Simulate a vehicle on a track and evaluate its guiding forces and accelerations by the rules of EN 14363.

    Parameters
    ----------
    track : Track, TrackSource, spec or path
        Track; without curves only test zone 1 is evaluated.
    design : Design, Model or path
        Vehicle.
    speed : float or str
        Speed [m/s], or a quantity.
    cant_deficiency : float, optional
        Target of the two-dimensional method in curves [m], see `estimate_two_dimensional`; without it the
        one-dimensional method.
    seed : int, optional
        Seed that replaces that of the spec.
    jobs : int, optional
        Threads.

    Returns
    -------
    dict
        `zones` with their sections and `quantities` (estimated maximum, limit, exceeded), `verdict` ("lateral limits
        kept", "limit exceeded" or "incomplete"), `exceeded`, `missing`, `notes`.

    Raises
    ------
    ValueError
        As `railui.ride_quality.evaluation.ride`.

    Examples
    --------
    >>> result = evaluate_simulated("erri_b176_low length=3000", "designs/bogie_under_coach.yaml", 40.0)
    >>> result["verdict"], result["zones"][0]["sections"]
    ('incomplete', 30)
    """
    model, excitation = resolve_model(design), excitation_of(track, speed, seed)
    recordings, diverged_at = simulate_recording(model, excitation, jobs)
    if not recordings and diverged_at is None:
        raise ValueError(f"a ride of {excitation.duration:.3g} s is too short for an evaluation: give a longer track")
    straight = [] if excitation.track.has_curves else [STRAIGHT_NOTE]
    notes = [*excitation.source.notes, *straight, *model_notes(model)]
    failures = [] if diverged_at is None else [f"the vehicle left the track at s = {diverged_at:.5g} m"]
    head = {"track": excitation.source.name, "seed": excitation.source.seed, "source": "simulated"}
    return head | evaluate(recordings, vehicle_data(model), cant_deficiency, notes, failures, excitation.speed)


def evaluate_measured(path: str | Path, design: ModelSource, *, cant_deficiency: float | None = None) -> dict[str, Any]:
    """Evaluate the measured columns of a run by the rules of EN 14363; the design gives loads and bogie mass.

    Parameters
    ----------
    path : path
        Run with t, v and at least one of Yi.right, Yi.left, Yi, Qi.right, Qi.left [N], ay_body, floor.NAME, ayf
        [m/s^2]; curvature [1/m] or radius [m], and cant_deficiency [m] or cant [m], select the test zone.
    design : Design, Model or path
        Vehicle.
    cant_deficiency : float, optional
        As for `evaluate_simulated`.

    Returns
    -------
    dict
        As `evaluate_simulated`.

    Raises
    ------
    FileProblems
        For a faulty run.
    """
    model = resolve_model(design)
    vehicle, half_gauge = vehicle_data(model), float(half_gauges(model, model.row[None])[0])
    recordings, notes = read_recording(path, vehicle.wheel_loads, half_gauge)
    head = {"track": Path(path).name, "seed": None, "source": "measured"}
    return head | evaluate(recordings, vehicle, cant_deficiency, notes)


def vehicle_data(model: Model) -> VehicleData:
    """Return wheel loads, mass of the heaviest bogie and use of a vehicle."""
    design = model.design
    loads = tuple(design.values[path] for path in wheel_load_paths(model))
    if design.structure is None:
        masses = [design.values["vehicle.frame.mass"] + 2.0 * design.values["vehicle.wheelset.mass"]]
    else:
        masses = bogie_masses(design.structure, design.values)
    return VehicleData(loads, max(masses, default=None), design.riding.use)


def evaluate(
    recordings: Sequence[Recording],
    vehicle: VehicleData,
    cant_deficiency: float | None,
    notes: Sequence[str],
    failures: Sequence[str] = (),
    speed: float = 0.0,
) -> dict[str, Any]:
    """Return the evaluation of the unbroken pieces of a run, see `evaluate_simulated`.

    failures: reasons for "limit exceeded" beyond the limits; speed: the least that the section lengths are for [m/s].
    """
    if recordings:  # single samples are no speed that was run at
        speed = max(speed, float(np.percentile(np.concatenate([piece.v for piece in recordings]), SPEED_PERCENTILE)))
    samples: dict[Sample, _Values] = {}
    sections: list[Section] = []
    for piece in recordings:
        cut = cut_sections(piece.s, piece.curvature, piece.cant_deficiency, speed)
        sections += cut
        for signal in signals_of(piece, vehicle):
            _collect(samples, signal, cut)
    zones = [_zone_result(zone, sections, samples, cant_deficiency, speed) for zone in ZONES]
    exceeded = [*failures]
    exceeded += [f"zone {z['zone']}: {q['text']}" for z in zones for q in z["quantities"] if q["exceeded"]]
    missing = missing_parts(zones, recordings, vehicle)
    return {
        "standard": "EN 14363",
        "speed": speed,
        "cant_deficiency": cant_deficiency,
        "zones": zones,
        "verdict": EXCEEDED if exceeded else INCOMPLETE if missing else KEPT,
        "exceeded": exceeded,
        "missing": missing,
        "notes": [*notes, LATERAL_NOTE, DISCLAIMER],
    }


def _collect(samples: dict[Sample, _Values], signal: Signal, sections: Sequence[Section]) -> None:
    """Add the values of a signal in each section to the statistical samples."""
    for section in sections:
        values = signal.values(section)
        if values:
            key = (section.zone, signal.quantity, signal.sample_place(section))
            sample = samples.setdefault(key, _Values(signal))
            sample.values += values
            sample.cant_deficiencies += [section.cant_deficiency] * len(values)


def _zone_result(
    zone: Zone,
    sections: Sequence[Section],
    samples: dict[Sample, _Values],
    target: float | None,
    speed: float,
) -> dict[str, Any]:
    """Return the result of one test zone."""
    own = [section for section in sections if section.zone is zone]
    radii = [1.0 / abs(section.curvature) for section in own if section.curvature]
    return {
        "zone": zone.number,
        "caption": zone.caption,
        "sections": len(own),
        "required": zone.required,
        "section_length": zone.section_length(speed),
        "mean_radius": float(np.mean(radii)) if radii and zone.number > 1 else None,
        "mean_cant_deficiency": float(np.mean([s.cant_deficiency for s in own])) if own else None,
        "quantities": [
            _quantity_result(place, sample, zone, target)
            for (in_zone, _, place), sample in samples.items()
            if in_zone is zone
        ],
    }


def _quantity_result(place: str, sample: _Values, zone: Zone, target: float | None) -> dict[str, Any]:
    """Return the estimated maximum of a quantity against its limit."""
    signal, limit = sample.signal, sample.signal.limits[zone.number]
    estimate = _estimate(sample, zone, target)
    value = estimate.value
    is_exceeded = value is not None and value > limit
    factor, unit = (1e-3, "kN") if signal.unit == "N" else (1.0, signal.unit.replace("1", ""))
    shown = "undefined" if value is None else f"{value * factor:.3g}"
    text = f"{signal.quantity}, {place}: {shown} of {limit * factor:.3g} {unit}".strip()
    return {
        "quantity": signal.quantity,
        "place": place,
        "category": signal.category,
        "unit": signal.unit,
        "values": estimate.count,
        "mean": estimate.mean,
        "sd": estimate.sd,
        "method": estimate.method,
        "rule": estimate.rule,
        "estimated": value,
        "limit": limit,
        "share": None if value is None else value / limit,
        "exceeded": is_exceeded,
        "text": text,
    }


def _estimate(sample: _Values, zone: Zone, target: float | None) -> Estimate:
    """Return the estimated maximum: the largest for stability and lift, by regression in curves with a target.

    Quasi-static values have a sign in the regression; their maximum is a magnitude.
    """
    values, category = np.array(sample.values), sample.signal.category
    if category == "largest":
        sd = float(values.std(ddof=1)) if values.size > 1 else None
        return Estimate(float(values.max()), values.size, float(values.mean()), sd, "largest", "largest value")
    if target is not None and zone.number > 1:
        found = estimate_two_dimensional(values, np.array(sample.cant_deficiencies), target, CONFIDENCE.get(category))
        if found is not None:
            return _magnitude(found) if category == "quasi-static" else found
    return estimate_one_dimensional(np.abs(values) if category == "quasi-static" else values, FACTORS[category])


def _magnitude(estimate: Estimate) -> Estimate:
    value = None if estimate.value is None else abs(estimate.value)
    return replace(estimate, value=value, mean=abs(estimate.mean))
