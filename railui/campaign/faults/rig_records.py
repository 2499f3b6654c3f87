"""Records of a rig that lack something: the input that drives it, or the length that its motion needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.dataset import Dataset
from railui.campaign.faults.fault import Fault
from railui.campaign.faults.rig_responses import driving_column, longest_records
from railui.campaign.segment import Segment
from railui.campaign.settings.faults import FaultSettings

FORCE = "F"  # of a bench; of no use to a rig
DEAD_BAND = 0.1  # of the standard deviation, within which a motion does not cross its mean


def faults_of_records(dataset: Dataset, runs: Mapping[str, Sequence[Segment]]) -> list[Fault]:
    """Find a rig that is driven by an input which no run contains, and runs of less than some periods of the motion."""
    settings, records = dataset.campaign.settings.faults, longest_records(runs)
    if not records:
        return []
    if any(np.any(s.columns.get(driving_column(s), 0.0)) for s in records.values()):
        return [f for name, s in records.items() if (f := _short_record(name, s, settings)) is not None]
    return _absent_input(dataset, records, settings)


def _absent_input(dataset: Dataset, records: Mapping[str, Segment], settings: FaultSettings) -> list[Fault]:
    """Find that no run has an input, though the motion is no free decay; serious where the design states the input."""
    ratios = [_decay(s.columns[s.channels[0]]) for s in records.values()]
    ratio = float(np.exp(np.mean(np.log(np.maximum(ratios, 1e-12)))))
    if ratio < settings.min_steady_motion:
        return []
    text = (
        "no run has an input u, which is taken as 0, but the motion does not decay as a free one does (last third over "
        f"first: {ratio:.2f})"
    )
    has_force = all(FORCE in run.unknown_columns for run in dataset.runs)
    if has_force:
        text += f"; the column {FORCE} is not used"
    remedy = (
        "write `input: motion` in the design if z is prescribed, or name the force u if it drives the mass"
        if has_force
        else "record what drives the rig as the column u"
    )
    is_serious = has_force or "vehicle.rig.input" in dataset.campaign.design.settings
    return [Fault("input", ("u",), None, None, "1", tuple(records), text, is_serious, remedy=remedy)]


def _decay(x: FloatArray) -> float:
    """Standard deviation of the last third of a motion [n] over that of its first."""
    third = max(len(x) // 3, 1)
    first, last = float(np.std(x[:third])), float(np.std(x[-third:]))
    return last / first if first > 0.0 else 1.0


def _short_record(name: str, segment: Segment, settings: FaultSettings) -> Fault | None:
    column = driving_column(segment) if segment.kind == "bench" else segment.channels[0]
    periods = 0.5 * mean_crossings(segment.columns[column])
    if periods >= settings.min_record_periods:
        return None
    text = (
        f"the record lasts {segment.samples * segment.dt:.3g} s, less than {settings.min_record_periods:g} periods of "
        "its motion: parameters rest on a part of a cycle"
    )
    remedy = "record longer, or leave the run out"
    return Fault("duration", (column,), periods, None, "1", (name,), text, False, remedy=remedy)


def mean_crossings(x: FloatArray) -> int:
    """Count how often a series [n] crosses its mean, beyond a dead band.

    >>> mean_crossings(np.sin(2.0 * np.pi * np.linspace(0.0, 3.0, 300)))
    5
    """
    y = x - np.mean(x)
    y = y[np.abs(y) > DEAD_BAND * np.std(y)]
    return int(np.count_nonzero(np.diff(np.sign(y))))
