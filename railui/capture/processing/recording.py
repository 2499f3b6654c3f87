"""A recording as series: channels with units on one clock, and its unbroken pieces at even intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray

GAP = 1.5  # intervals
UNEVEN = 0.01  # share of an interval by which a stamp may be off before a piece is laid anew


@dataclass(frozen=True, eq=False)
class Recording:
    """Channels [n] by name in their units, t [s] rising with gaps; `against` is t, or s of a recording car [m]."""

    name: str
    t: FloatArray
    channels: Mapping[str, FloatArray]
    units: Mapping[str, str | None]
    against: str = "t"
    drift: float | None = None
    sources: tuple[Path, ...] = ()
    notes: list[str] = field(default_factory=list)

    @property
    def interval(self) -> float:
        """Time from sample to sample, as most steps show it."""
        return interval_of(self.t)


def interval_of(t: FloatArray) -> float:
    """The interval of stamps with gaps between them: the median, then the mean of all that are near it."""
    steps = np.abs(np.diff(t))
    middle = float(np.median(steps))
    return float(np.mean(steps[np.abs(steps - middle) <= 0.5 * middle]))


@dataclass(frozen=True, eq=False)
class Piece:
    """An unbroken piece: t [n] at even intervals dt [s], channels [n]."""

    t: FloatArray
    dt: float
    channels: Mapping[str, FloatArray]

    def __len__(self) -> int:
        return int(self.t.size)


def pieces(recording: Recording, names: tuple[str, ...], shortest: float) -> tuple[list[Piece], dict[str, int]]:
    """The pieces in which all of some channels are there without a gap, of `shortest` [s] and more; what was counted.

    Stamps that jitter by more than a hundredth of the interval are laid anew by a cubic spline.
    """
    from scipy.interpolate import CubicSpline

    dt, t = recording.interval, recording.t
    good = np.all([np.isfinite(recording.channels[name]) for name in names], axis=0) if names else np.isfinite(t)
    rows = np.flatnonzero(good)
    cuts = np.flatnonzero(np.diff(t[rows]) > GAP * dt) + 1
    counts = {"rows": t.size, "gaps": len(cuts), "short": 0, "uneven": 0, "used": 0}
    found = []
    for part in np.split(rows, cuts):
        if part.size < 4 or (part.size - 1) * dt < shortest:
            counts["short"] += bool(part.size)
            continue
        at = t[part]
        step = float((at[-1] - at[0]) / (part.size - 1))
        even = at[0] + step * np.arange(part.size)
        columns = {name: recording.channels[name][part] for name in names}
        if np.max(np.abs(at - even)) > UNEVEN * step:
            counts["uneven"] += 1
            even = at[0] + dt * np.arange(int((at[-1] - at[0]) / dt + 1e-6) + 1)
            columns = {name: np.asarray(CubicSpline(at, x)(even)) for name, x in columns.items()}
            step = dt
        counts["used"] += even.size
        found.append(Piece(even, step, columns))
    return found, counts
