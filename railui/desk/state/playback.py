"""Replay of a recording: position, speed and the rows up to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.arrays import FloatArray
from railui.runs.segments import GAP_INTERVALS

SPEEDS: Final = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)  # recorded seconds per second


@dataclass(frozen=True, eq=False)
class PlayedRun:
    """Series of a recording that is replayed.

    t [n] in s, increasing, values [n, channel]; interval in s; markers: time [s] and text; clipped: names of channels.
    """

    name: str
    t: FloatArray
    values: FloatArray
    names: tuple[str, ...]
    units: tuple[str, ...]
    interval: float
    markers: tuple[tuple[float, str], ...] = ()
    clipped: frozenset[str] = frozenset()

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.t[-1] - self.t[0])


def find_gaps(t: FloatArray, interval: float) -> list[tuple[float, float]]:
    """Return the last time [s] before each gap and the duration of the gap [s].

    >>> find_gaps(np.array([0.0, 0.1, 0.2, 0.6, 0.7]), 0.1)
    [(0.2, 0.4)]
    """
    steps = np.diff(t)
    return [(float(t[i]), round(float(steps[i]), 9)) for i in np.flatnonzero(steps > GAP_INTERVALS * interval)]


class Playback:
    """Position in a recording that moves with the time that passes.

    Attributes
    ----------
    position
        Time since the first sample [s].
    speed
        Recorded seconds per second.
    is_playing
        False if it is paused or at its end.
    """

    def __init__(self, run: PlayedRun) -> None:
        self.run = run
        self.position = 0.0
        self.speed = 1.0
        self.is_playing = True
        self.gaps = find_gaps(run.t, run.interval)
        self._gap_times = np.array([at for at, _ in self.gaps])
        self._missing = np.cumsum([round(seconds / run.interval) - 1 for _, seconds in self.gaps], dtype=np.int64)

    def advance(self, seconds: float) -> None:
        """Move by a time that has passed [s]; playing ends at the end of the recording."""
        if self.is_playing:
            self.seek(self.position + self.speed * seconds)
            self.is_playing = self.position < self.run.duration

    def toggle(self) -> None:
        """Pause or play; at the end from the beginning."""
        if not self.is_playing and self.position >= self.run.duration:
            self.position = 0.0
        self.is_playing = not self.is_playing

    def seek(self, position: float) -> None:
        """Move to a time since the first sample [s], within the recording."""
        self.position = min(max(0.0, position), self.run.duration)

    def change_speed(self, by: int) -> None:
        """Take the next of the SPEEDS, or the one before."""
        index = SPEEDS.index(self.speed) + by
        self.speed = SPEEDS[min(max(0, index), len(SPEEDS) - 1)]

    @property
    def clock(self) -> float:
        """Time of the recording at the position [s]."""
        return float(self.run.t[0]) + self.position

    def rows(self, seconds: float) -> slice:
        """Return the rows of the last seconds before the position."""
        first = int(np.searchsorted(self.run.t, self.clock - seconds, "left"))
        return slice(first, self.sample_count)

    @property
    def sample_count(self) -> int:
        """Number of samples up to the position."""
        return int(np.searchsorted(self.run.t, self.clock + 0.5 * self.run.interval, "right"))

    @property
    def gap_count(self) -> int:
        """Number of gaps before the position."""
        return int(np.searchsorted(self._gap_times, self.clock - self.run.interval, "right"))

    @property
    def missing_count(self) -> int:
        """Number of samples that are missing before the position."""
        return int(self._missing[self.gap_count - 1]) if self.gap_count else 0

    def fractions(self, times: Sequence[float]) -> list[float]:
        """Return the places of recorded times [s] in the recording, 0 .. 1."""
        return [(t - float(self.run.t[0])) / max(self.run.duration, self.run.interval) for t in times]
