"""Logger's clock: unwrapped 32-bit counter, and its drift against the host's clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

COUNTER_PERIOD = 1 << 32  # of a logger's microseconds and frame numbers
MIN_WINDOWS = 8  # of a drift estimate
MAX_WINDOWS = 200
POINTS_PER_WINDOW = 8
MIN_SIGNIFICANCE = 3.0  # standard deviations from which a drift counts
MIN_NUMBERS = 20  # of frames, after which their mean distance in time is known
LEAST_JUMP = 1.0  # s, by which a clock that was set forward gets ahead of the host's from one point to the next
UNUSUAL_ADVANCE = 10.0  # times the usual one between two points, as of a recording that is replayed fast
MAX_STEP_NUMBERS = 100  # of frames from one sample to the next; more are an interruption


class LoggerClock:
    """Unwrapped 32-bit microseconds of one start of a logger.

    Attributes
    ----------
    now, origin
        Newest and first time [us].
    """

    def __init__(self) -> None:
        self.now: int | None = None
        self.origin: int | None = None
        self._number: int | None = None
        self._numbers = 0
        self._microseconds = 0

    def set(self, time: int, number: int) -> None:
        """Set the newest time [us], of a frame with this number."""
        if self.now is not None and self._number is not None:
            numbers = (number - self._number) % COUNTER_PERIOD
            if numbers <= MAX_STEP_NUMBERS:
                self._numbers += numbers
                self._microseconds += time - self.now
        self.now, self._number = time, number
        self.origin = time if self.origin is None else self.origin

    def expected_advance(self, number: int, stated: float) -> float:
        """Return the time [us] from the newest value to a frame with this number; `stated` [us] without experience."""
        if self._number is None or self._numbers < MIN_NUMBERS:
            return stated
        return (number - self._number) % COUNTER_PERIOD * self._microseconds / self._numbers

    def unwrap(self, time: int, expected: float) -> int | None:
        """Return a time on a clock that does not wrap.

        Parameters
        ----------
        time
            Counter of the logger [us].
        expected
            Time since the last value [us] by the frame numbers, which gives the number of wraps in a long silence.

        Returns
        -------
        Unwrapped time [us], None if the clock ran back.
        """
        if self.now is None:
            return time
        forward = (time - self.now) % COUNTER_PERIOD
        advance = int(forward + round((expected - forward) / COUNTER_PERIOD) * COUNTER_PERIOD)
        return None if advance < 0 else self.now + advance


@dataclass(frozen=True)
class ClockFit:
    """Clock model: host time [s] = offset + (1 + drift) logger time; standard deviation of the drift.

    `shortest_delay` [s] is that of host time against logger time.
    """

    offset: float
    drift: float
    drift_sd: float
    shortest_delay: float

    @property
    def is_significant(self) -> bool:
        """True if the drift exceeds its uncertainty."""
        return is_significant(self.drift, self.drift_sd)

    def host_time(self, logger_time: float) -> float:
        """Return the host time [s] at a logger time [s]; without the drift where that is not significant."""
        if not self.is_significant:
            return self.shortest_delay + logger_time
        return self.offset + (1.0 + self.drift) * logger_time


def is_significant(drift: float, sd: float) -> bool:
    """Return True if a drift exceeds its uncertainty."""
    return abs(drift) > MIN_SIGNIFICANCE * sd


def fit_clock(points: Sequence[tuple[float, float]]) -> ClockFit | None:
    """Fit the clock model by least squares.

    A sample arrives some milliseconds late, never early: the pair with the smallest delay of each window is used. Where
    the logger's clock was set forward, the model is that of the times before.

    Parameters
    ----------
    points
        Pairs (logger time, host time) [s].

    Returns
    -------
    Fitted model, None for fewer than `MIN_WINDOWS` pairs.
    """
    points = points[: _first_jump(points)]
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
    return ClockFit(float(y.mean() - drift * x.mean()), drift, sd, float(delay.min()))


def _first_jump(points: Sequence[tuple[float, float]]) -> int:
    """Return the first of the pairs (logger time, host time) [s] after the logger's clock was set forward.

    From one pair to the next it gets ahead of the host's by more than a second and far more than it usually does, and
    the delay falls below all before. That of samples which a dead line held back falls to what it was.
    """
    logger_time, host_time = np.reshape(np.array(points), (-1, 2)).T
    delay = host_time - logger_time
    ahead = -np.diff(delay)
    if not ahead.size:
        return len(points)
    limit = LEAST_JUMP + UNUSUAL_ADVANCE * float(np.median(np.abs(ahead)))
    is_jump = (ahead > limit) & (delay[1:] < np.minimum.accumulate(delay)[:-1] - LEAST_JUMP)
    return 1 + int(np.argmax(is_jump)) if is_jump.any() else len(points)
