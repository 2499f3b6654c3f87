"""Sign of the cross-level by the part of the motion that it causes.

The response to the cross-level adds to that to the alignment. Of a measured channel, each has a share: near 1 where the
nominal model is right, of either sign never where it is only inaccurate. A map that reverses every lateral and yaw
channel but the cross-level leaves the same data as a reversed cross-level, since the vehicle is symmetric.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.faults.regression import jackknife_regression
from railui.campaign.segment import Segment
from railui.campaign.settings.faults import FaultSettings
from railui.runs.columns import is_compared
from railui.vehicle.model import Model

SETTLING = 3.0  # s left out at its start


def has_reversed_cross_level(settings: FaultSettings, model: Model, segment: Segment) -> bool | None:
    """Return True where the response to the cross-level has the wrong sign; None where the data do not show it."""
    shares = cross_level_shares(settings, model, segment)
    clear = shares[np.abs(shares[:, 0]) > settings.cross_level_standard_errors * shares[:, 1], 0]
    if not len(clear) or abs(np.median(clear)) < settings.min_cross_level_share:
        return None
    return bool(np.median(clear) < 0.0)


def cross_level_shares(settings: FaultSettings, model: Model, segment: Segment) -> FloatArray:
    """Return share and standard error [channel, 2] of the simulated response to the cross-level in measured channels.

    Least squares on the response to the alignment alone and on the difference that the cross-level makes. Empty where
    there is no cross-level, where the vehicle diverges, and where the alignment too has the wrong sign.
    """
    names = [c for c in segment.channels if is_compared(c)]
    samples, skipped = min(segment.samples, round(settings.nominal_duration / segment.dt)), round(SETTLING / segment.dt)
    has_track = all(np.any(segment.columns.get(c, 0.0)) for c in ("yw", "phiw"))
    if not names or not has_track or samples < 2 * skipped:
        return np.zeros((0, 2))
    level = replace(segment, columns={**segment.columns, "phiw": np.zeros(segment.samples)}, tables={})
    alignment, both = (_simulate(model, s.truncated(samples), names) for s in (level, segment))
    if alignment is None or both is None:
        return np.zeros((0, 2))
    rows = []
    for k, name in enumerate(names):
        inputs = np.stack([alignment[k], both[k] - alignment[k]])[:, skipped:]
        shares = jackknife_regression(inputs, segment.columns[name][skipped:samples])
        if shares[0, 0] > 0.0:
            rows.append(shares[1])
    return np.array(rows).reshape(-1, 2)


def _simulate(model: Model, segment: Segment, names: Sequence[str]) -> FloatArray | None:
    """Simulate the channels [channel, n] of a segment; None where the vehicle diverges."""
    vehicles = model.vehicles(segment.coach_forces)
    batch = model.on_segment(*segment.segment_key).single_batch()
    steps = vehicles.required_steps(batch, *segment.speeds, segment.dt)[0]
    table = segment.table(model.wheelset_spacing(), steps)
    series, diverged = vehicles.simulate(batch, table, segment.dt, steps, list(names), jobs=1)
    return None if diverged[0] >= 0 else np.asarray(series[0])
