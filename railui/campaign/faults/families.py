"""Families of hypotheses: kinds of faults by channel, and the value of each that fits best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.faults.hypotheses import RADIAN, Consistency, G, Hypothesis
from railui.campaign.faults.spectra import ROLL, RunSpectra
from railui.runs.plausibility import MAX_RMS

TRACK, DEFLECTIONS = ("yw", "phiw"), ("d1", "d2")
DISPLACEMENTS, ACCELERATIONS = ("e1", "e2", "d1", "d2"), ("ay1", "ay2", "ayf")
ENDS = (("e1", "e2"), ("ay1", "ay2"), DEFLECTIONS)
ANGLES = ("rf", "phiw")
# channels that one logger or one kind of sensor records
LOGGERS = (
    TRACK,
    ("ay1", "ay2", "ayf", "rf"),
    ("ay1", "ay2", "ayf"),
    ("ay1", "ay2"),
    ("ayf", "rf"),
    ("e1", "e2"),
    DEFLECTIONS,
    ("e1", "e2", "d1", "d2"),
    ("e1", "e2", *TRACK),
    ("d1", "d2", "ayf", "rf"),
)
GAINS = np.geomspace(0.1, 10.0, 41)
MAX_DELAY, DELAY_STEP = 0.3, 4e-3  # s
CONTINUOUS = ("gain", "delay", "offset", "gravity", "clock")


def candidates(spectra: RunSpectra) -> list[str]:
    """List the channels that are in a relation."""
    names = dict.fromkeys(name.split(".")[0] for name in spectra.names)
    return [c for c in names if c != "roll" and spectra.is_related(c) and _is_recorded(spectra, c)]


def _is_recorded(spectra: RunSpectra, channel: str) -> bool:
    return bool(np.any(spectra.z[:, :, spectra.columns(channel)]))


def discrete_hypotheses(
    channels: Sequence[str], has_units: bool = True, rms: Mapping[str, float] | None = None
) -> list[Hypothesis]:
    """List signs, units and exchanges of channels; rms: as recorded, by which some units are impossible."""
    size = rms or {}
    out = [Hypothesis("sign", (c,), -1.0) for c in channels]
    out += [Hypothesis("sign", pair, -1.0) for pair in (TRACK, DEFLECTIONS) if set(pair) <= set(channels)]
    if has_units:
        out += [Hypothesis("unit", (c,), g) for c in channels for g in unit_gains(c, size.get(c, 0.0))]
    for group in (DISPLACEMENTS, ACCELERATIONS):
        out += [Hypothesis("exchanged", pair) for pair in combinations([c for c in group if c in channels], 2)]
    ends = [pair for pair in ENDS if set(pair) <= set(channels)]
    if len(ends) > 1 and {"yw", "e1", "e2"} <= set(channels):  # without the track a wrong sign of rf is the same
        out.append(Hypothesis("exchanged", (*(a for a, _ in ends), *(b for _, b in ends[::-1]))))
    return out


def unit_gains(channel: str, rms: float = 0.0) -> list[float]:
    """List the gains of numbers in another unit than the header says; rms: as recorded, which excludes some units."""
    gains = [10.0**k for k in (-3, -2, -1, 1, 2, 3)]
    if channel in (*ACCELERATIONS, "az"):
        gains += [G, 1.0 / G]
    gains += [RADIAN, 1.0 / RADIAN] if channel in ANGLES else []
    return [g for g in gains if rms <= g * MAX_RMS.get(channel, np.inf)]


def groups_of(channels: Sequence[str]) -> list[tuple[str, ...]]:
    """List single channels and groups of one logger, each group once."""
    groups = [tuple(c for c in group if c in channels) for group in LOGGERS]
    return list(dict.fromkeys([*((c,) for c in channels), *(g for g in groups if 1 < len(g) < len(channels))]))


def continuous_families(channels: Sequence[str], spectra: RunSpectra) -> list[tuple[Hypothesis, FloatArray]]:
    """List gain, delay, offset of the track and gravity, each with the grid of its values."""
    lags = DELAY_STEP * np.arange(-round(MAX_DELAY / DELAY_STEP), round(MAX_DELAY / DELAY_STEP) + 1)
    lags = lags[lags != 0.0]
    out = [(Hypothesis("gain", (c,)), GAINS[GAINS != 1.0]) for c in channels]
    out += [(Hypothesis("delay", group), lags) for group in groups_of(channels)]
    speed = float(np.mean(spectra.speed))
    if "yw" in channels:
        out.append((Hypothesis("offset", tuple(c for c in TRACK if c in channels)), lags * speed))
    felt = [c for c in channels if ROLL.get(c) in spectra.names and np.any(spectra.z[:, :, spectra.columns("phiw")])]
    out += [(Hypothesis("gravity", (c,)), G * np.array([-1.2, -1.0, -0.8, 0.8, 1.0, 1.2])) for c in felt]
    return out


def best_of_family(
    consistency: Consistency, family: Hypothesis, grid: FloatArray, given: Sequence[Hypothesis] = ()
) -> tuple[Hypothesis, float, float]:
    """Find the best value of a continuous hypothesis; return it, its misfit and its standard deviation.

    given: hypotheses that hold besides.
    """
    misfits = consistency.misfits([[*given, replace(family, value=float(x))] for x in grid])
    best = int(np.argmin(misfits))
    spacing = np.abs(np.diff(grid))
    step = float(spacing[min(best, len(spacing) - 1)])
    centre, lowest, curvature = float(grid[best]), float(misfits[best]), 0.0
    for _ in range(6):
        step *= 0.5
        points = [centre - step, centre, centre + step]
        if family.kind == "gain" and points[0] <= 0:
            continue
        low, mid, high = consistency.misfits([[*given, replace(family, value=x)] for x in points])
        curvature = (low - 2.0 * mid + high) / step**2
        if curvature > 0:
            shift = float(np.clip(0.5 * (low - high) / (low - 2.0 * mid + high), -1.0, 1.0))
            centre += shift * step
        else:
            centre = points[int(np.argmin([low, mid, high]))]
    lowest = float(consistency.misfits([[*given, replace(family, value=centre)]])[0])
    sd = 1.0 / np.sqrt(curvature) if curvature > 0 else float("nan")
    return replace(family, value=centre), lowest, float(sd)
