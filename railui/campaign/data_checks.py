"""Data quality checks before any fit: gaps, constant channels, data faults, hunting and coherence.

The checks report; they never alter the data.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.coherence import coherence_limits
from railui.campaign.dataset import Dataset
from railui.campaign.faults.diagnose import diagnose
from railui.campaign.faults.fault import Diagnosis
from railui.campaign.finding import Finding
from railui.campaign.segment import Segment
from railui.dsp.filters import butterworth, sosfiltfilt
from railui.dsp.spectra import periodogram
from railui.runs.columns import Form
from railui.runs.segments import stuck_samples
from railui.vehicle.track_geometry import track_geometry

HUNTING_BAND = (0.8, 8.0)  # Hz
HUNTING_WINDOW = 100.0  # m, of the moving rms
HUNTING_STEP = 10.0  # m
MIN_HUNTING_POSITIONS = 10  # of the window
MIN_HUNTING_RATIO = 2.0  # rms to its median


def check_data(dataset: Dataset, diagnosis: Diagnosis | None = None, jobs: int | None = 1) -> list[Finding]:
    """Run all data checks; serious findings come first.

    diagnosis: of the dataset, where it is known already. jobs: number of threads; None for all.
    """
    findings = (diagnose(dataset, jobs) if diagnosis is None else diagnosis).findings()
    for entry, run in zip(dataset.campaign.runs, dataset.runs, strict=True):
        findings += check_gaps(entry.name, run.counts)
        for name in (*run.responses, *run.coach_forces):
            findings += check_stuck(entry.name, name, run.columns[name], run.columns["t"], run.rate, run.kind)
    geometry = track_geometry(dataset.campaign.design)
    for segment in dataset.segments:
        if not segment.is_rig:
            findings += coherence_limits(segment, geometry)
            findings += check_hunting(segment)
    return sorted(findings, key=lambda f: not f.serious)


def check_gaps(file: str, counts: Mapping[str, int]) -> list[Finding]:
    """Report the rows of a run that are not used, from its counts of rows."""
    if not counts.get("gaps") and not counts.get("nan_rows"):
        return []
    share = 100.0 * counts["unused_rows"] / max(counts["rows"], 1)
    gaps, rows = counts["gaps"], counts["nan_rows"]
    found = f"{gaps} gap{'' if gaps == 1 else 's'}, {rows} row{'' if rows == 1 else 's'} with empty cells"
    text = f"{found}: {share:.3g} % of the rows are not used"
    return [Finding("gaps", file, None, counts["gaps"], "1", text)]


def check_stuck(file: str, name: str, x: FloatArray, t: FloatArray, rate: float, form: Form) -> list[Finding]:
    """Report the longest time at one value of a channel [n], if it is long."""
    edges = np.concatenate(([0], np.flatnonzero(np.diff(x) != 0) + 1, [len(x)]))
    longest = int(np.argmax(np.diff(edges)))
    samples = int(edges[longest + 1] - edges[longest])
    if samples < stuck_samples(rate, form) or not np.any(x):
        return []
    seconds = samples / rate
    start = float(t[edges[longest]])
    text = f"{name} is constant for {seconds:.1f} s from {start:.1f} s on: this part is not used"
    return [Finding("stuck", file, name, seconds, "s", text, start=start, end=start + seconds)]


def check_hunting(segment: Segment) -> list[Finding]:
    """Report sections where a wheelset swings much more than elsewhere, with frequency and wavelength."""
    name = next((c for c in segment.channels if c.startswith("ay") and c[2:].isdigit()), None)
    if name is None:
        return []
    s = segment.columns["s"]
    x = sosfiltfilt(butterworth(2, HUNTING_BAND, 1.0 / segment.dt), segment.columns[name])
    starts = np.arange(s[0], s[-1] - HUNTING_WINDOW, HUNTING_STEP)
    if len(starts) < MIN_HUNTING_POSITIONS:
        return []
    energy = np.concatenate(([0.0], np.cumsum(x * x)))
    first, last = np.searchsorted(s, starts), np.searchsorted(s, starts + HUNTING_WINDOW)
    rms = np.sqrt((energy[last] - energy[first]) / np.maximum(last - first, 1))
    ratio = rms / np.median(rms)
    is_high = np.concatenate(([0], (rms > MIN_HUNTING_RATIO * np.median(rms)).astype(int), [0]))
    begins, ends = np.flatnonzero(np.diff(is_high) == 1), np.flatnonzero(np.diff(is_high) == -1) - 1
    return [
        _hunting_section(segment, name, x, slice(int(first[i]), int(last[j]) - 1), float(ratio[i : j + 1].max()))
        for i, j in zip(begins, ends, strict=True)
    ]


def _hunting_section(segment: Segment, name: str, x: FloatArray, section: slice, ratio: float) -> Finding:
    """Describe a section of hunting of the filtered acceleration x [n]."""
    s, t = segment.columns["s"], segment.columns["t"]
    f, power = periodogram(x[section], 1.0 / segment.dt)
    frequency = float(f[np.argmax(power)])
    wavelength = float(segment.columns["v"][section].mean()) / max(frequency, 1e-9)
    text = (
        f"hunting from {s[section.start]:.0f} to {s[section.stop]:.0f} m: {name} swings {ratio:.1f} times its median "
        f"at {frequency:.2f} Hz, wavelength {wavelength:.1f} m"
    )
    start, end = float(t[section.start]), float(t[section.stop])
    return Finding("hunting", segment.file, name, frequency, "Hz", text, start=start, end=end)
