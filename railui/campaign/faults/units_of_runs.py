"""Unit of a channel of a rig in one run: its response to the input is powers of ten off that in the other runs.

A response that is not linear, or a resonance, does not change by a factor of 100 at the same frequency of the input.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.corrections.correction import Correction, Corrections, yaml_line
from railui.campaign.faults.fault import Fault
from railui.campaign.faults.rig_responses import (
    MIN_FREQUENCIES,
    are_driven,
    driving_column,
    explained_share,
    longest_records,
    measured_response,
    median_decades,
    phase_agreement,
    ratio_to_nominal,
    window_seconds,
)
from railui.campaign.segment import Segment
from railui.campaign.settings.faults import FaultSettings
from railui.vehicle.design import Design


def units_of_runs(
    runs: Mapping[str, Sequence[Segment]], settings: FaultSettings, design: Design | None = None
) -> list[Fault]:
    """Find the channels of which one run has another unit than the others.

    Parameters
    ----------
    runs
        Segments by the name of their run, all of a rig with an input, or of a component whose motion is prescribed.
    design
        Nominal model, with which runs without a common frequency of the input are compared.
    """
    records = longest_records(runs)
    names = list(records)
    if len(names) < 2 or not are_driven(records):
        return []
    reference, seconds = driving_column(records[names[0]]), window_seconds(records)
    found: dict[str, dict[str, int]] = {}  # powers of ten by run and channel
    for channel in dict.fromkeys(c for s in records.values() for c in s.channels if c != reference):
        having = [name for name in names if channel in records[name].channels]
        logs = [_log_response(records[name], channel, seconds) for name in having]
        nominal = [_decades_off_nominal(design, records[name], channel, seconds, settings) for name in having]
        for i, decades in _off_by_decades(settings, logs, nominal):
            found.setdefault(having[i], {})[channel] = decades
    other = names[0] if len(names) == 2 else None  # of two runs either may be wrong
    return [_fault(run, decades, records[run], reference, other) for run, decades in found.items()]


def _off_by_decades(
    settings: FaultSettings, logs: Sequence[FloatArray], nominal: Sequence[float]
) -> list[tuple[int, int]]:
    """Responses that are off the largest group of equal ones, or the first, and by how many powers of ten.

    nominal: decades off the nominal model, which compare two responses without a frequency in common.
    """
    n = len(logs)
    apart = np.array([[_decades_apart(logs[i], logs[j]) for j in range(n)] for i in range(n)])
    level = np.array(nominal)
    apart = np.where(np.isfinite(apart), apart, level[:, None] - level[None, :])
    agreeing = np.sum(np.abs(apart) < 1.0, axis=1)  # NaN where neither compares them
    main = int(np.argmax(agreeing))
    off = []
    for i in range(n):
        decades = round(apart[i, main]) if np.isfinite(apart[i, main]) else 0
        if abs(decades) >= settings.min_unit_decades and abs(apart[i, main] - decades) <= settings.max_unit_deviation:
            off.append((i, decades))
    return off


def _decades_off_nominal(
    design: Design | None, segment: Segment, channel: str, seconds: float, settings: FaultSettings
) -> float:
    """Decades by which a response is off that of the nominal model; NaN where their phases or coherence are poor."""
    if design is None or design.effects:
        return float("nan")
    ratio = ratio_to_nominal(design, segment, channel, seconds)
    has_phase = phase_agreement(ratio) > settings.nominal_agreement
    is_response = explained_share(segment, channel, seconds) > settings.min_explained_share
    return median_decades(ratio) if has_phase and is_response else float("nan")


def _log_response(segment: Segment, channel: str, seconds: float) -> FloatArray:
    """Logarithm to base 10 of the response per frequency k / seconds; NaN where the input has no power."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.log10(np.abs(measured_response(segment, channel, seconds))))


def _decades_apart(one: FloatArray, other: FloatArray) -> float:
    """Median difference of two logarithmic responses; NaN where their inputs have too few frequencies in common."""
    count = min(len(one), len(other))
    difference = one[:count] - other[:count]
    known = difference[np.isfinite(difference)]
    return float(np.median(known)) if len(known) >= MIN_FREQUENCIES else float("nan")


def _fault(run: str, decades: Mapping[str, int], record: Segment, reference: str, other: str | None) -> Fault:
    """Return the fault of the channels of a run; of its input where all of several channels are off alike.

    other: run of which the same channel may have the wrong unit instead.
    """
    measured = [c for c in record.channels if c != reference]
    is_input = len(measured) > 1 and set(decades) == set(measured) and len(set(decades.values())) == 1
    gains = {c: 10.0**k for c, k in decades.items()}
    alternatives = []
    if is_input:
        gains = {reference: 1.0 / gains[measured[0]]}
    elif len(measured) == 1:
        alternatives.append(yaml_line(_corrections({reference: 1.0 / gains[measured[0]]}, run)))
    if other is not None:
        alternatives.append(yaml_line(_corrections({c: 1.0 / gain for c, gain in gains.items()}, other)))
    gain = next(iter(gains.values()))
    size = f"{gain:g} times too large" if gain > 1 else f"{1 / gain:g} times too small"
    verb = "are" if len(gains) > 1 else "is"
    text = f"{', '.join(gains)} {verb} {size} for the input, compared with the other runs"
    corrections = _corrections(gains, run)
    return Fault("unit", tuple(gains), gain, None, "1", (run,), text, True, corrections, tuple(alternatives))


def _corrections(gains: Mapping[str, float], run: str) -> Corrections:
    return Corrections(tuple(Correction(c, gain=gain, runs=(run,)) for c, gain in gains.items()))
