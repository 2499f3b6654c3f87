"""The gate before an adjustment: what is wrong with the data themselves, each with its channel and a number.

Rows that are not used, channels that stick, clip or hunt; what channels owe one another (`owed`), and what of them no
linear vehicle can follow (`ceilings`). Data are never altered.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.coherence import coherence_limits
from railui.campaign.consistency import kinematic_checks
from railui.campaign.dataset import Dataset, Segment
from railui.campaign.finding import Finding
from railui.dsp.filters import butterworth, sosfiltfilt
from railui.dsp.spectra import periodogram

CLIPPED = 3  # samples in a row at the extreme
STUCK = 1.0  # s at one value
WINDOW, STEP, RISEN = 100.0, 10.0, 2.0  # m, m, times the median rms: a hunting stretch
HUNTING = (0.8, 8.0)  # Hz


def check_data(measurement: Dataset) -> list[Finding]:
    """All findings of a measurement, the serious ones first."""
    found: list[Finding] = []
    for entry, run in zip(measurement.campaign.runs, measurement.runs, strict=True):
        found += _gaps(entry.name, run.counts)
        for name in (*run.responses, *run.coach):
            found += _stuck(entry.name, name, run.columns[name], run.columns["t"], run.rate)
    for stretch in measurement.stretches:
        found += [f for c in stretch.channels for f in _clipping(stretch, c)]
        if stretch.kind == "bogie":
            found += kinematic_checks(stretch, measurement.campaign.design.values)
            found += coherence_limits(stretch, measurement.campaign.design.values)
            found += check_hunting(stretch)
    return sorted(found, key=lambda f: not f.serious)


def _gaps(file: str, counts: Mapping[str, int]) -> list[Finding]:
    if not counts.get("gaps") and not counts.get("nan_rows"):
        return []
    share = 100.0 * counts["unused_rows"] / max(counts["rows"], 1)
    text = f"{counts['gaps']} gaps, {counts['nan_rows']} rows with empty cells: {share:.1f} % of the rows are not used"
    return [Finding("gaps", file, None, counts["gaps"], "1", text)]


def _stuck(file: str, name: str, x: FloatArray, t: FloatArray, rate: float) -> list[Finding]:
    edges = np.concatenate(([0], np.flatnonzero(np.diff(x) != 0) + 1, [len(x)]))
    longest = int(np.argmax(np.diff(edges)))
    seconds = (edges[longest + 1] - edges[longest]) / rate
    if seconds < STUCK or not np.any(x):
        return []
    start = float(t[edges[longest]])
    text = f"{name} holds one value for {seconds:.1f} s from {start:.1f} s: not used there"
    return [Finding("stuck", file, name, float(seconds), "s", text, False, start, start + float(seconds))]


def _clipping(stretch: Segment, name: str) -> list[Finding]:
    """Samples in a row at the very extreme of a channel."""
    x = stretch.columns[name]
    count = 0
    for extreme in (x.max(), x.min()):
        at = np.concatenate(([0], (x == extreme).astype(int), [0]))
        starts, ends = np.flatnonzero(np.diff(at) == 1), np.flatnonzero(np.diff(at) == -1)
        long = (ends - starts)[ends - starts >= CLIPPED]
        count += int(long.sum())
    if not count:
        return []
    share = 100.0 * count / len(x)
    text = f"{name} is clipped: {count} samples ({share:.2f} %) stand in a row at its extreme"
    return [Finding("clipping", stretch.file, name, share / 100.0, "1", text, serious=share > 0.1)]


def check_hunting(stretch: Segment) -> list[Finding]:
    """Stretches where a wheelset swings much more than along the rest, with frequency and wavelength."""
    name = next((c for c in ("ay1", "ay2") if c in stretch.columns), None)
    if name is None:
        return []
    s, t = stretch.columns["s"], stretch.columns["t"]
    x = sosfiltfilt(butterworth(2, HUNTING, 1.0 / stretch.dt), stretch.columns[name])
    starts = np.arange(s[0], s[-1] - WINDOW, STEP)
    if len(starts) < 10:
        return []
    total = np.concatenate(([0.0], np.cumsum(x * x)))
    first, last = np.searchsorted(s, starts), np.searchsorted(s, starts + WINDOW)
    rms = np.sqrt((total[last] - total[first]) / np.maximum(last - first, 1))
    risen = np.concatenate(([0], (rms > RISEN * np.median(rms)).astype(int), [0]))
    out = []
    for k, j in zip(np.flatnonzero(np.diff(risen) == 1), np.flatnonzero(np.diff(risen) == -1) - 1, strict=True):
        a, b = int(first[k]), int(last[j]) - 1
        f, power = periodogram(x[a:b], 1.0 / stretch.dt)
        frequency = float(f[np.argmax(power)])
        v = float(stretch.columns["v"][a:b].mean())
        times = float(rms[k : j + 1].max() / np.median(rms))
        text = (
            f"hunting from {s[a]:.0f} to {s[b]:.0f} m: {name} swings {times:.1f} times its median "
            f"at {frequency:.2f} Hz, wavelength {v / max(frequency, 1e-9):.1f} m"
        )
        out.append(Finding("hunting", stretch.file, name, frequency, "Hz", text, False, float(t[a]), float(t[b])))
    return out
