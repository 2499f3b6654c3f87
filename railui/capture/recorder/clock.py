"""A logger's clock: its 32 bits unwrapped, and its drift against this machine's, from samples that only arrive late."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

WRAP = 1 << 32  # us, and frames: where a logger's counters begin again
WINDOWS = 8  # fewer tell no drift
MOST_WINDOWS = 200


class Clock:
    """Unwraps the 32-bit microseconds of one start of a logger."""

    def __init__(self) -> None:
        self.now: int | None = None
        self.origin: int | None = None

    def unwrapped(self, time: int, expected: float) -> int | None:
        """Microseconds on a clock that does not wrap, `expected` us after the last; None where it ran back."""
        if self.now is None:
            return time
        forward = (time - self.now) % WRAP
        turns = max(round((expected - forward) / WRAP), 0)
        if not turns and forward >= WRAP // 2:
            return None
        return self.now + forward + turns * WRAP


@dataclass(frozen=True)
class ClockFit:
    """time here [s] = offset + (1 + drift) time there; the standard deviation of the drift."""

    offset: float
    drift: float
    drift_sd: float

    def here(self, there: float) -> float:
        """The time of this machine [s] at a time of the logger [s]."""
        return self.offset + (1.0 + self.drift) * there


def fit_clock(points: Sequence[tuple[float, float]]) -> ClockFit | None:
    """Fits (time there, time here) pairs [s]; None where they are too few.

    A sample arrives some milliseconds late, never early: of each window of time the promptest is taken.
    """
    if len(points) < WINDOWS:
        return None
    there, here = np.array(points).T
    late = here - there
    windows = np.array_split(np.arange(len(points)), min(MOST_WINDOWS, max(WINDOWS, len(points) // 8)))
    best = np.array([w[np.argmin(late[w])] for w in windows if w.size])
    x, y = there[best], late[best]
    spread = x - x.mean()
    power = float(spread @ spread)
    if power <= 0:
        return None
    drift = float(spread @ (y - y.mean())) / power
    rest = y - y.mean() - drift * spread
    sd = float(np.sqrt(rest @ rest / max(len(x) - 2, 1) / power))
    return ClockFit(float(y.mean() - drift * x.mean()), drift, sd)
