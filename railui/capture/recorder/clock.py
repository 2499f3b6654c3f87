"""Logger's clock: unwrapped 32-bit counter, and its drift against the host's clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

COUNTER_PERIOD = 1 << 32  # of a logger's microseconds and frame numbers
MIN_WINDOWS = 8  # of a drift estimate
MAX_WINDOWS = 200
POINTS_PER_WINDOW = 8


class LoggerClock:
    """Unwrapped 32-bit microseconds of one start of a logger."""

    def __init__(self) -> None:
        self.now: int | None = None
        self.origin: int | None = None

    def unwrap(self, time: int, expected: float) -> int | None:
        """Return a time on a clock that does not wrap.

        Parameters
        ----------
        time
            Counter of the logger [us].
        expected
            Time since the last value [us], which gives the number of wraps in a long silence.

        Returns
        -------
        Unwrapped time [us], None if the clock ran back.
        """
        if self.now is None:
            return time
        forward = (time - self.now) % COUNTER_PERIOD
        wraps = max(round((expected - forward) / COUNTER_PERIOD), 0)
        if not wraps and forward >= COUNTER_PERIOD // 2:
            return None
        return self.now + forward + wraps * COUNTER_PERIOD


@dataclass(frozen=True)
class ClockFit:
    """Clock model: host time [s] = offset + (1 + drift) logger time; standard deviation of the drift."""

    offset: float
    drift: float
    drift_sd: float

    def host_time(self, logger_time: float) -> float:
        """Return the host time [s] at a logger time [s]."""
        return self.offset + (1.0 + self.drift) * logger_time


def fit_clock(points: Sequence[tuple[float, float]]) -> ClockFit | None:
    """Fit the clock model by least squares.

    A sample arrives some milliseconds late, never early: the pair with the smallest delay of each window is used.

    Parameters
    ----------
    points
        Pairs (logger time, host time) [s].

    Returns
    -------
    Fitted model, None for fewer than `MIN_WINDOWS` pairs.
    """
    if len(points) < MIN_WINDOWS:
        return None
    logger_time, host_time = np.array(points).T
    delay = host_time - logger_time
    count = min(MAX_WINDOWS, max(MIN_WINDOWS, len(points) // POINTS_PER_WINDOW))
    windows = np.array_split(np.arange(len(points)), count)
    earliest = np.array([w[np.argmin(delay[w])] for w in windows if w.size])
    x = logger_time[earliest]
    y = delay[earliest]
    deviation = x - x.mean()
    power = float(deviation @ deviation)
    if power <= 0:
        return None
    drift = float(deviation @ (y - y.mean())) / power
    residual = y - y.mean() - drift * deviation
    sd = float(np.sqrt(residual @ residual / max(len(x) - 2, 1) / power))
    return ClockFit(float(y.mean() - drift * x.mean()), drift, sd)
