"""Sign and delay of the force of a component on a bench.

A component produces no energy: its force grows with the speed, also where its stiffness is negative. A force with the
wrong sign opposes the nominal model and does not dissipate. The phase of F/z is 0 for a spring and 90 degrees for a
damper; a force that is recorded late in one run turns away from the other runs in proportion to the frequency.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.campaign.corrections.correction import yaml_line
from railui.campaign.faults.fault import Fault
from railui.campaign.faults.hypotheses import Hypothesis
from railui.campaign.faults.merge import hypothesis_fault
from railui.campaign.faults.regression import jackknife_regression
from railui.campaign.faults.rig_responses import (
    MIN_FREQUENCIES,
    are_driven,
    longest_records,
    measured_response,
    phase_agreement,
    response_frequencies,
    window_seconds,
)
from railui.campaign.segment import Segment
from railui.campaign.settings.faults import FaultSettings
from railui.vehicle.design import Design

MAX_DELAY, DELAY_STEP = 0.3, 2e-3  # s
FORCE = "F"


def faults_of_force(design: Design, runs: Mapping[str, Sequence[Segment]], settings: FaultSettings) -> list[Fault]:
    """Find runs whose force has the opposite sign to the prescribed motion, and those in which it is recorded late."""
    records = longest_records(runs)
    if design.rig_input != "motion" or not are_driven(records):
        return []
    records = {name: s for name, s in records.items() if FORCE in s.columns}
    reversed_runs = _reversed_runs(design, records, settings)
    signed = {name: _reversed(s) if name in reversed_runs else s for name, s in records.items()}
    found = [_sign_fault(reversed_runs, len(records), settings)] if reversed_runs else []
    return found + _late_runs(design, signed, settings)


def _reversed(segment: Segment) -> Segment:
    return replace(segment, columns={**segment.columns, FORCE: -segment.columns[FORCE]}, tables={})


def _sign_fault(files: tuple[str, ...], count: int, settings: FaultSettings) -> Fault:
    h = Hypothesis("sign", (FORCE,), -1.0)
    fault = hypothesis_fault(h, files, len(files) < count, (), None, settings)
    return replace(fault, text=f"{fault.text}: it opposes the force of the nominal model, and none is dissipated")


def _reversed_runs(design: Design, records: Mapping[str, Segment], settings: FaultSettings) -> tuple[str, ...]:
    """Runs whose force opposes that of the nominal model and dissipates nothing; none where a delay explains all runs.

    Of all runs a delay beyond that of a sensor is less likely than a sign.
    """
    if design.effects or not records:
        return ()
    opposed = {name: x for name, s in records.items() if (x := _nominal_correlation(design, s)) < 0.0}
    opposed = {name: x for name, x in opposed.items() if not _dissipates(records[name], settings)}
    if not opposed or min(opposed.values()) > -settings.opposed_correlation:
        return ()
    limit = settings.serious_delay if len(opposed) == len(records) else MAX_DELAY
    lags = DELAY_STEP * np.arange(-round(limit / DELAY_STEP), round(limit / DELAY_STEP) + 1)
    together = [np.mean([_nominal_correlation(design, s, float(lag)) for s in records.values()]) for lag in lags]
    return () if max(together) > settings.opposed_correlation else tuple(opposed)


def _nominal_correlation(design: Design, segment: Segment, delay: float = 0.0) -> float:
    """Correlation of the force, advanced by a delay [s], with that of the linear nominal model; 0 if that is zero."""
    spring, damper = (design.values[f"vehicle.rig.{name}"] for name in ("stiffness", "damping"))
    nominal = spring * segment.columns["z"] + damper * _speed(segment)
    shift = round(delay / segment.dt)
    first, last = max(shift, 0), segment.samples + min(shift, 0)
    force, nominal = segment.columns[FORCE][first:last], nominal[first - shift : last - shift]
    if len(force) < 2 or not np.ptp(force) or not np.ptp(nominal):
        return 0.0
    return float(np.corrcoef(force, nominal)[0, 1])


def _speed(segment: Segment) -> FloatArray:
    vz = segment.columns.get("vz")
    return np.asarray(np.gradient(segment.columns["z"], segment.dt)) if vz is None else vz


def _dissipates(segment: Segment, settings: FaultSettings) -> bool:
    """True where the force clearly grows with the speed."""
    motion = np.stack([segment.columns["z"], _speed(segment)])
    damping, error = jackknife_regression(motion, segment.columns[FORCE])[1]
    return bool(damping > settings.fault_standard_errors * error)


def _late_runs(design: Design, records: Mapping[str, Segment], settings: FaultSettings) -> list[Fault]:
    """Find runs whose force is late or early against a run that agrees with more others, or with the nominal model."""
    names = list(records)
    seconds = window_seconds(records) if records else 1.0
    responses = [measured_response(s, FORCE, seconds) for s in records.values()]
    delays = [[_delay(x, y, seconds, settings) for y in responses] for x in responses]
    rank = [(row.count(0.0), _nominal_correlation(design, s)) for row, s in zip(delays, records.values(), strict=True)]
    found = []
    for i, row in enumerate(delays):
        rivals = [j for j, delay in enumerate(row) if delay and rank[j] > rank[i]]
        if not rivals:
            continue
        best = max(rivals, key=lambda j: rank[j])
        # of two runs either may be wrong, unless the nominal model decides
        is_decided = rank[best][0] > rank[i][0] or rank[best][1] - rank[i][1] > settings.min_agreement_gain
        found.append(_delay_fault(names[i], row[best] or 0.0, None if is_decided else names[best], settings))
    return found


def _delay_fault(run: str, delay: float, other: str | None, settings: FaultSettings) -> Fault:
    h = Hypothesis("delay", (FORCE,), delay)
    alternatives = () if other is None else (yaml_line(replace(h, value=-delay).corrections((other,))),)
    fault = hypothesis_fault(h, (run,), True, alternatives, None, settings)
    return replace(fault, text=f"{fault.text} against the motion, compared with the other runs")


def _delay(x: ComplexArray, y: ComplexArray, seconds: float, settings: FaultSettings) -> float | None:
    """Delay [s] of a response after another, where it alone makes their phases agree; else 0.

    It must turn the phase over the frequencies in common by more than the 90 degrees between a spring and a damper;
    None where these are too few for any.
    """
    count = min(len(x), len(y))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = x[:count] / y[:count]
    f, known = response_frequencies(ratio, seconds), np.isfinite(ratio)
    if known.sum() < MIN_FREQUENCIES or MAX_DELAY * np.ptp(f[known]) < settings.min_delay_turns:
        return None
    lags = DELAY_STEP * np.arange(-round(MAX_DELAY / DELAY_STEP), round(MAX_DELAY / DELAY_STEP) + 1)
    best = float(max(lags, key=lambda lag: phase_agreement(ratio, float(lag), f)))
    best, agreement = _refined(ratio, f, best)
    is_wide = abs(best) * float(np.ptp(f[known])) > settings.min_delay_turns
    gain = agreement - phase_agreement(ratio)
    is_better = agreement > settings.delayed_agreement and gain > settings.min_agreement_gain
    return best if is_wide and is_better and abs(best) > settings.serious_delay else 0.0


def _refined(ratio: ComplexArray, f: FloatArray, delay: float) -> tuple[float, float]:
    """Refine a delay by least squares on the remaining phase; return it and the agreement with it."""
    known = np.isfinite(ratio)
    w = 2.0 * np.pi * f[known]
    phase = np.angle(ratio[known] * np.exp(1j * w * delay))
    refined = delay - float(np.sum(w * phase) / np.sum(w**2))
    return refined, phase_agreement(ratio, refined, f)
