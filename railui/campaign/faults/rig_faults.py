"""Faults of the data of a rig that the responses to its input show, beyond the relations between its channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from railui.campaign.corrections.correction import Correction, Corrections, yaml_line
from railui.campaign.dataset import Dataset
from railui.campaign.faults.fault import Fault
from railui.campaign.faults.force_of_bench import faults_of_force
from railui.campaign.faults.hypotheses import Hypothesis
from railui.campaign.faults.merge import hypothesis_fault
from railui.campaign.faults.nominal_of_rig import faults_against_nominal
from railui.campaign.faults.rig_records import faults_of_records
from railui.campaign.faults.rig_responses import (
    are_driven,
    longest_records,
    measured_response,
    median_decades,
    phase_agreement,
    ratio_to_nominal,
    response_frequencies,
    window_seconds,
)
from railui.campaign.faults.rig_units import fault_of_header_units
from railui.campaign.faults.units_of_runs import units_of_runs
from railui.campaign.segment import Segment
from railui.campaign.settings.faults import FaultSettings
from railui.vehicle.design import Design

Runs = Mapping[str, Sequence[Segment]]


def faults_of_rig(dataset: Dataset, runs: Runs, faults: Sequence[Fault]) -> list[Fault]:
    """Return all faults of a rig: those of the relations, decided by the responses, and those of the responses."""
    design, settings = dataset.campaign.design, dataset.campaign.settings.faults
    differing = units_of_runs(runs, settings, design)
    found = [_decided_by_runs(f, differing) for f in faults]
    found = [_decided_by_nominal(f, design, runs, settings) for f in found]
    faulty = {name for f in found if f.serious for name in f.files}
    found += [f for f in differing if faulty.isdisjoint(f.files)]
    found += [*faults_of_force(design, runs, settings), *faults_of_records(dataset, runs)]
    if any(f.serious for f in found):
        return found
    for search in (fault_of_header_units, _absolute_acceleration, faults_against_nominal):
        if one := search(dataset, runs):
            return [*found, *one]
    return found


def _decided_by_runs(fault: Fault, differing: Sequence[Fault]) -> Fault:
    """Return a fault without alternatives where only one of them makes the run respond as the other runs do."""
    lines = {fault.yaml, *fault.alternatives}
    same = [f for f in differing if f.is_correctable and f.yaml in lines]
    if not fault.alternatives or len(same) != 1:
        return fault
    text = f"{same[0].text}, and contradicts the other channels"
    return replace(same[0], sd=fault.sd, text=text)


def _decided_by_nominal(fault: Fault, design: Design, runs: Runs, settings: FaultSettings) -> Fault:
    """Return a sign or a unit without alternatives where the response of the nominal model decides between them."""
    if fault.kind not in ("sign", "unit") or not fault.alternatives or fault.value is None:
        return fault
    records = {name: s for name, s in longest_records(runs).items() if name in fault.files}
    restricted = any(c.runs for c in fault.corrections.channels)
    if not are_driven(records) or design.effects or design.rig_input == "motion":
        return fault
    seconds = window_seconds(records)
    names = [c for s in records.values() for c in s.channels]
    trial = [Hypothesis(fault.kind, (c,), x) for c in dict.fromkeys(names) for x in {fault.value, 1.0 / fault.value}]
    lines = {fault.yaml, *fault.alternatives}
    trial = [h for h in trial if yaml_line(h.corrections(fault.files if restricted else ())) in lines]
    fitting = [h for h in trial if all(_fits_nominal(h, design, s, seconds, settings) for s in records.values())]
    if len(fitting) != 1:
        return fault
    decided = hypothesis_fault(fitting[0], fault.files, restricted, (), fault.sd, settings)
    return replace(decided, text=f"{decided.text} (by the response of the nominal model to the input)")


def _fits_nominal(h: Hypothesis, design: Design, segment: Segment, seconds: float, settings: FaultSettings) -> bool:
    """True where all channels respond as the nominal model does once the fault is corrected."""
    for channel in segment.channels:
        gain = h.value if channel in h.channels else 1.0
        ratio = ratio_to_nominal(design, segment, channel, seconds) / gain
        has_size = h.kind == "sign" or abs(median_decades(ratio)) < settings.max_nominal_decades
        if not (has_size and phase_agreement(ratio) > settings.nominal_agreement):
            return False
    return True


def _absolute_acceleration(dataset: Dataset, runs: Runs) -> list[Fault]:
    """Find an accelerometer that measures the absolute acceleration where z is measured from the accelerated base."""
    design, settings = dataset.campaign.design, dataset.campaign.settings.faults
    records = longest_records(runs)
    has_both = records and all({"z", "az"} <= set(s.columns) for s in records.values())
    gain = design.values.get("vehicle.rig.gain", 0.0)
    if design.rig_input != "base_acceleration" or not gain or not has_both or not are_driven(records):
        return []
    seconds = window_seconds(records)
    for segment in records.values():
        share = _share_of_base(segment, seconds) / gain
        scatter = float(np.nanmedian(np.abs(share - 1.0)))
        if not scatter < settings.absolute_acceleration_tolerance:
            return []
    text = (
        "az is the absolute acceleration: it exceeds z'', which is measured from the base, by the acceleration u of "
        "the base"
    )
    corrections, remedy = Corrections((Correction("az", leave_out=True),)), "subtract u from az in the runs"
    return [Fault("absolute", ("az",), 1.0, None, "1", tuple(records), text, True, corrections, remedy=remedy)]


def _share_of_base(segment: Segment, seconds: float) -> np.ndarray:
    """Response of az - z'' to the acceleration of the base, per frequency."""
    z, az = (measured_response(segment, c, seconds) for c in ("z", "az"))
    w = 2.0 * np.pi * response_frequencies(z, seconds)
    return np.asarray(az + w**2 * z)
