"""Recordings: channels with units on one clock, and their unbroken segments at even intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import Spline
from railui.runs.segments import GAP_INTERVALS, INTERVAL_TOLERANCE

MIN_SEGMENT_ROWS = 4  # of a cubic spline
ROUNDING_MARGIN = 1e-6  # intervals


@dataclass(frozen=True, eq=False)
class Recording:
    """Series of several channels.

    Attributes
    ----------
    name
        Name of the recording.
    t
        Increasing time [s] with gaps, or the distance [m] of a track recording car, [n].
    channels
        Values [n] by name, in their units.
    units
        Units by name, None if unknown.
    abscissa
        "t" if `t` is a time, "s" if it is a distance.
    drift
        Relative drift of the logger's clock, None if unknown.
    sources
        Files.
    notes
        Remarks for the user.
    clock
        Channel that `t` was taken from, None if there was none.
    device
        Name of the logger, "" if unknown.
    """

    name: str
    t: FloatArray
    channels: Mapping[str, FloatArray]
    units: Mapping[str, str | None]
    abscissa: str = "t"
    drift: float | None = None
    sources: tuple[Path, ...] = ()
    notes: list[str] = field(default_factory=list)
    clock: str | None = None
    device: str = ""

    @property
    def interval(self) -> float:
        """Sampling interval, gaps ignored."""
        return sampling_interval(self.t)

    def columns(self) -> dict[str, FloatArray]:
        """Return time or distance and all channels, for a file.

        Raises
        ------
        ValueError
            If a channel has the name of the time or distance.
        """
        channels = {name: x for name, x in self.channels.items() if name != self.clock}
        if self.abscissa in channels:
            raise ValueError(f"a channel is called {self.abscissa!r}, as the time or distance will be: rename it")
        return {self.abscissa: self.t, **channels}

    def unit(self, name: str) -> str | None:
        """Return the unit of a column of `columns`, None if it is unknown."""
        if name == self.abscissa:
            return "m" if self.abscissa == "s" else "s"
        return self.units.get(name)


def sampling_interval(t: FloatArray) -> float:
    """Return the interval of time stamps with gaps: the mean of all steps within half of their median.

    >>> round(sampling_interval(np.array([0.0, 0.1, 0.2, 5.2, 5.3])), 9)
    0.1
    """
    steps = np.abs(np.diff(t))
    median = float(np.median(steps))
    return float(np.mean(steps[np.abs(steps - median) <= 0.5 * median]))


@dataclass(frozen=True, eq=False)
class UniformSegment:
    """Unbroken segment: t [n] at even intervals dt [s], channels [n]."""

    t: FloatArray
    dt: float
    channels: Mapping[str, FloatArray]

    def __len__(self) -> int:
        return int(self.t.size)


def uniform_segments(
    recording: Recording, names: tuple[str, ...], min_duration: float
) -> tuple[list[UniformSegment], dict[str, int]]:
    """Find the segments of a recording in which some channels have no gap.

    Time stamps that differ from even ones by more than a hundredth of the interval are resampled by a cubic spline.

    Parameters
    ----------
    recording
        Recording.
    names
        Channels that must be present.
    min_duration
        Shortest duration of a segment [s].

    Returns
    -------
    Segments, and the counts rows, gaps, short, uneven, used.
    """
    dt = recording.interval
    rows = _complete_rows(recording, names)
    cuts = np.flatnonzero(np.diff(recording.t[rows]) > GAP_INTERVALS * dt) + 1
    counts = {"rows": recording.t.size, "gaps": len(cuts), "short": 0, "uneven": 0, "used": 0}
    segments = []
    for part in np.split(rows, cuts):
        if part.size < MIN_SEGMENT_ROWS or (part.size - 1) * dt < min_duration:
            counts["short"] += bool(part.size)
            continue
        channels = {name: recording.channels[name][part] for name in names}
        segment, is_uneven = _uniform_segment(recording.t[part], channels, dt)
        counts["uneven"] += is_uneven
        counts["used"] += len(segment)
        segments.append(segment)
    return segments, counts


def _complete_rows(recording: Recording, names: tuple[str, ...]) -> NDArray[np.intp]:
    """Return the rows in which all channels have a value."""
    series = [recording.channels[name] for name in names] or [recording.t]
    return np.flatnonzero(np.all(np.isfinite(series), axis=0))


def _uniform_segment(t: FloatArray, channels: dict[str, FloatArray], dt: float) -> tuple[UniformSegment, bool]:
    """Return an unbroken part at even intervals, and whether it had to be resampled (at the interval dt)."""
    step = float((t[-1] - t[0]) / (t.size - 1))
    even = t[0] + step * np.arange(t.size)
    if np.max(np.abs(t - even)) <= INTERVAL_TOLERANCE * step:
        return UniformSegment(even, step, channels), False
    even = t[0] + dt * np.arange(int((t[-1] - t[0]) / dt + ROUNDING_MARGIN) + 1)
    return UniformSegment(even, dt, {name: Spline(t, x)(even) for name, x in channels.items()}), True
