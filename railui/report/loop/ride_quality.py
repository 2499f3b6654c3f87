"""Ride quality and mean errors of the models on the validation runs."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.comparison import cut_samples
from railui.campaign.segment import Segment
from railui.identification.result import LoopResult
from railui.ride_quality.comfort import comfort_point_transfer
from railui.ride_quality.weighting import W_D, cascade, weighted_rms

KEYS = ("sd_e1", "sd_e2", "flange_fraction", "weighted_acceleration")


def mean_errors(result: LoopResult) -> dict[str, float]:
    """Return the mean of measured minus simulated per channel, which the comparison band excludes."""
    errors: dict[str, list[float]] = {}
    series = result.validations["after"].series
    for segment, simulated in zip(result.dataset.validation, series, strict=True):
        difference = _trim(result, segment, segment.measured(segment.channels) - simulated)
        for channel, values in zip(segment.channels, difference, strict=True):
            errors.setdefault(channel, []).append(float(values.mean()))
    return {channel: float(np.mean(values)) for channel, values in errors.items()}


def ride_quality(result: LoopResult) -> dict[str, dict[str, float | None]]:
    """Return ride-quality quantities of the measured signals and of every model (thesis 2.3)."""
    segments = result.dataset.validation
    series = {"measured": [segment.measured(segment.channels) for segment in segments]}
    series |= {model: list(result.validations[model].series) for model in ("declared", "before", "after")}
    return {name: _ride_quality(result, segments, values) for name, values in series.items()}


def _ride_quality(result: LoopResult, segments: list[Segment], series: list[FloatArray]) -> dict[str, float | None]:
    design = result.nominal.design
    if design.kind != "bogie":
        return {}
    clearance = design.values["contact.flange_clearance"]
    weighting = cascade(comfort_point_transfer(design.riding), W_D)
    values: dict[str, list[float]] = {}
    for segment, x in zip(segments, series, strict=True):
        columns = dict(zip(segment.channels, _trim(result, segment, x), strict=True))
        displacements = {e: columns[e] for e in ("e1", "e2") if e in columns}
        for e, displacement in displacements.items():
            values.setdefault(f"sd_{e}", []).append(float(displacement.std()))
        if displacements:
            values.setdefault("flange_fraction", []).append(_flange_fraction(displacements.values(), clearance))
        if "ayf" in columns:
            values.setdefault("weighted_acceleration", []).append(weighted_rms(columns["ayf"], segment.dt, weighting))
    return {key: float(np.mean(values[key])) if values.get(key) else None for key in KEYS}


def _flange_fraction(displacements: Iterable[FloatArray], clearance: float) -> float:
    """Return the largest proportion of flange contact of a wheelset; NaN where the simulation diverged."""
    e = np.array(list(displacements))
    return float(np.mean(np.abs(e) >= clearance, axis=1).max()) if np.all(np.isfinite(e)) else float("nan")


def _trim(result: LoopResult, segment: Segment, x: FloatArray) -> FloatArray:
    """Cut series [..., n] by the samples that the comparison excludes at both ends."""
    cut = cut_samples(result.dataset.campaign, segment)
    return np.asarray(x[..., cut : x.shape[-1] - cut])
