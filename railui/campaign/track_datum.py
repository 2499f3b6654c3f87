"""Datum of the track in the runs of a campaign: an alignment shifted or turned as a whole is the same track."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.settings.noise import NoiseSettings
from railui.runs.run import Run
from railui.track.line import MIN_SAMPLES
from railui.track.mean_line import LONGEST_IRREGULARITY, mean_line


def with_datum_removed(run: Run, settings: NoiseSettings) -> Run:
    """Return a run with yw from its mean line where this is farther from zero than the irregularities from it.

    Springs to the ground are tied to yw = 0, where a record with an arbitrary datum or heading would be a steady side
    force. A mean line near zero may be an irregularity and remains, in a short run also one that is farther away.
    """
    s, yw = _distance(run), run.columns.get("yw")
    if yw is None or s is None:
        return run
    is_known = np.isfinite(s) & np.isfinite(yw)
    if is_known.sum() < MIN_SAMPLES:
        return run
    known = s[is_known]
    offset, heading = mean_line(known, yw[is_known])
    line = offset + heading * (s - known[0])
    limit = settings.max_datum_ratio
    if known[-1] - known[0] < 2.0 * LONGEST_IRREGULARITY:
        limit *= settings.short_run_datum_factor
    if _rms(line[is_known]) <= limit * _rms((yw - line)[is_known]):
        return run
    turned = (
        f" and a heading of {1e3 * heading:.2g} mrad" if abs(heading) * (known[-1] - known[0]) > abs(offset) else ""
    )
    note = f"yw is taken from its mean line: an offset of {1e3 * offset:.3g} mm{turned} is a matter of its datum"
    return replace(run, columns={**run.columns, "yw": yw - line}, notes=(*run.notes, note))


def _distance(run: Run) -> FloatArray | None:
    """Return the distance [row] along the track, the integral of the speed where it is not recorded; None without."""
    if "s" in run.columns:
        return run.columns["s"]
    t, v = run.columns["t"], run.columns.get("v")
    if v is None or not np.isfinite(v).any():
        return None
    is_known = np.isfinite(v)
    speed = np.interp(t, t[is_known], v[is_known])
    return np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))])


def _rms(x: FloatArray) -> float:
    return float(np.sqrt(np.mean(x**2)))
