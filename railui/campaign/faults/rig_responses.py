"""Frequency responses of a rig or a component on a bench: measured in each run, and of the linear nominal model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.campaign.segment import Segment
from railui.dsp.spectra import csd, welch
from railui.vehicle.design import Design

WINDOWS = 4  # in the shortest record
MIN_INPUT_POWER = 1e-2  # of the largest density of the input, where a response is known
MIN_FREQUENCIES = 3  # at which a response must be known
DERIVATIVE_ORDERS = {"z": 0, "vz": 1, "az": 2}


def longest_records(runs: Mapping[str, Sequence[Segment]]) -> dict[str, Segment]:
    """Return the longest segment of every run."""
    return {name: max(parts, key=lambda s: s.samples) for name, parts in runs.items()}


def driving_column(segment: Segment) -> str:
    """Return the column that drives a rig (u) or a component on a bench (z)."""
    return "z" if segment.kind == "bench" else "u"


def are_driven(records: Mapping[str, Segment]) -> bool:
    """True where the driving column of every record is recorded and varies."""
    return bool(records) and all(np.any(s.columns.get(driving_column(s), 0.0)) for s in records.values())


def window_seconds(records: Mapping[str, Segment]) -> float:
    """Length [s] of the windows of all records: frequencies are multiples of its inverse."""
    return min(s.samples * s.dt for s in records.values()) / WINDOWS


def measured_response(segment: Segment, channel: str, seconds: float) -> ComplexArray:
    """Response of a channel to the driving column at the frequencies k / seconds, k from 1.

    NaN where the driving column has no power.
    """
    rate = 1.0 / segment.dt
    n = round(seconds * rate)
    x, y = segment.columns[driving_column(segment)], segment.columns[channel]
    _, density = welch(x, rate, n)
    _, cross = csd(x, y, rate, n)
    with np.errstate(divide="ignore", invalid="ignore"):
        response = cross / density
    return np.where(density >= MIN_INPUT_POWER * density.max(), response, np.nan)[1:]


def response_frequencies(response: ComplexArray, seconds: float) -> FloatArray:
    """Frequencies [Hz] of a response of `measured_response`."""
    return np.arange(1, len(response) + 1) / seconds


def explained_share(segment: Segment, channel: str, seconds: float) -> float:
    """Share of a channel's power that its response to the driving column explains, at the same frequencies."""
    n = round(seconds / segment.dt)
    response = measured_response(segment, channel, seconds)
    _, driving = welch(segment.columns[driving_column(segment)], 1.0 / segment.dt, n)
    _, power = welch(segment.columns[channel], 1.0 / segment.dt, n)
    return float(np.nansum(np.abs(response) ** 2 * driving[1:]) / max(float(power[1:].sum()), 1e-300))


def nominal_response(
    design: Design, channel: str, f: FloatArray, values: Mapping[str, float] | None = None
) -> ComplexArray:
    """Response of a channel of the linear nominal model to the driving column at frequencies [Hz].

    m z'' + c z' + k z = gain u of a force, gain (c u' + k u) of a moving base; -m gain u where z is measured from an
    accelerated base; F = k z + c z' of a component. values: in place of those of the design.
    """
    w = 2.0 * np.pi * f
    values = design.values if values is None else values
    spring = values["vehicle.rig.stiffness"] + 1j * w * values["vehicle.rig.damping"]
    if design.rig_input == "motion":
        return np.asarray(spring)
    mass, gain = values["vehicle.rig.mass"], values["vehicle.rig.gain"]
    force = {"force": np.ones_like(w), "base_displacement": spring, "base_acceleration": np.full_like(w, -mass)}
    with np.errstate(divide="ignore", invalid="ignore"):
        motion = gain * force[design.rig_input] / (spring - mass * w**2)
    return np.asarray(motion * (1j * w) ** DERIVATIVE_ORDERS[channel])


def ratio_to_nominal(design: Design, segment: Segment, channel: str, seconds: float) -> ComplexArray:
    """Measured over nominal response at the frequencies k / seconds; NaN where either is not known or zero."""
    measured = measured_response(segment, channel, seconds)
    return ratio_of_responses(measured, nominal_response(design, channel, response_frequencies(measured, seconds)))


def ratio_of_responses(measured: ComplexArray, nominal: ComplexArray) -> ComplexArray:
    """Ratio of two responses; NaN where either is not known or zero."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = measured / nominal
    return np.where(np.isfinite(ratio) & (ratio != 0.0), ratio, np.nan)


def median_decades(ratio: ComplexArray) -> float:
    """Median logarithm to base 10 of the ratio of two responses; NaN where it is not known."""
    return float(np.nanmedian(np.log10(np.abs(ratio)))) if np.isfinite(ratio).any() else float("nan")


def phase_agreement(ratio: ComplexArray, delay: float = 0.0, f: FloatArray | None = None) -> float:
    """Mean cosine of the phase between two responses, from -1 (opposite) to 1, every frequency alike.

    delay: time [s] by which the first response is advanced at frequencies f. NaN where too few are known.
    """
    known = np.isfinite(ratio)
    if known.sum() < MIN_FREQUENCIES:
        return float("nan")
    phase = np.angle(ratio[known])
    return float(np.mean(np.cos(phase if f is None else phase + 2.0 * np.pi * f[known] * delay)))
