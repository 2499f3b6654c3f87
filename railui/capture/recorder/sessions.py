"""Contents of a recording: sessions with their rows, markers, and counts."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from railui.arrays import FloatArray
from railui.capture.protocol.messages import Hello

# the samples of a block are spaced uniformly up to the time stamp of the next one
MAX_RATE_DEVIATION = 0.1  # of a sensor from the rate that its hello states
MIN_BLOCKS = 5  # after which the sensor's own interval is known
SMOOTHING_FACTOR = 0.1  # of that interval
MAX_EXCESS = 0.5  # samples by which the next block may come late without a missing sample
MAX_PAUSE = 5.0  # intervals; longer ones do not count for the rate
MIN_RATE_SAMPLES = 100
MIN_REPORTED_DEVIATION = 0.005  # of the rate


@dataclass
class RecordingCounts:
    """Counters of a recording; lost frames by their numbers, missing samples by their times."""

    lost_frames: int = 0
    repeated_frames: int = 0
    samples: int = 0
    gaps: int = 0
    missing_samples: int = 0
    overruns: int = 0
    reconnects: int = 0
    restarts: int = 0
    layout_changes: int = 0
    clock_jumps: int = 0
    forward_jumps: int = 0  # of the time by more than a second, without a lost frame
    frames_without_hello: int = 0


@dataclass(frozen=True, eq=False)
class Rows:
    """Decoded samples of one session: t [n] in s of the logger's clock, values [n, channel]."""

    t: FloatArray
    values: FloatArray


@dataclass
class PendingSamples:
    """Samples of one frame that are not decoded yet."""

    t: float  # s of the first sample
    count: int
    interval: float  # s between samples
    data: bytes | tuple[float, ...]


@dataclass(eq=False)
class LoggerSession:
    """One logger session: same connection, boot and channel layout.

    Attributes
    ----------
    number
        Number of the session in its recording, from 1.
    hello
        Description of the logger.
    reason
        Why the session began: begin, reconnect, restart, other channels, ...
    origin
        Microseconds of the unwrapped clock at t = 0.
    first_time, last_time
        Times of the first and the last sample [s], None before the first.
    samples, gaps, missing_samples
        Counts of the session.
    status
        Last temperature [degC] and battery [V].
    pending
        Samples that are not decoded yet.
    start
        Number of the logger's start, from 0; times of one start are on one clock.
    frame_time, frame_samples
        Time of the first sample of the newest frame [s], and its number of samples.
    interval
        Time between the samples of a block [s].
    """

    number: int
    hello: Hello
    reason: str
    origin: int
    start: int = 0
    first_time: float | None = None
    samples: int = 0
    gaps: int = 0
    missing_samples: int = 0
    status: dict[str, float | None] = field(default_factory=dict)
    pending: list[PendingSamples] = field(default_factory=list, repr=False)
    frame_time: float = 0.0
    frame_samples: int = 0
    interval: float = 0.0
    _blocks: int = 0
    _span: float = 0.0  # s over which consecutive frames came, and their samples
    _span_samples: int = 0

    def __post_init__(self) -> None:
        self.interval = 1.0 / self.hello.rate

    @property
    def last_time(self) -> float | None:
        """Time of the last sample [s], None before the first."""
        if self.first_time is None:
            return None
        interval = self.pending[-1].interval if self.pending else self.interval
        return self.frame_time + (self.frame_samples - 1) * interval

    @property
    def true_rate(self) -> float | None:
        """Sampling rate [Hz] that the time stamps show, None if it is the stated one."""
        if self._span_samples < MIN_RATE_SAMPLES:
            return None
        rate = self._span_samples / self._span
        return rate if abs(rate / self.hello.rate - 1) > MIN_REPORTED_DEVIATION else None

    def space_newest_frame(self, t: float, skipped: int) -> float:
        """Space the samples of the newest frame uniformly, up to the stamp `t` [s] of the next after `skipped` lost.

        Returns
        -------
        Time from its last sample to `t`, in intervals of the stated rate: 1 without a gap, more than
        `GAP_INTERVALS` with one, 0 or less if `t` precedes it.
        """
        stated = 1.0 / self.hello.rate
        advance = t - self.frame_time
        if not skipped and 0 < advance < MAX_PAUSE * stated * self.frame_samples:
            self._span += advance
            self._span_samples += self.frame_samples
        excess = advance / self.interval - self.frame_samples
        limit = MAX_RATE_DEVIATION * self.frame_samples
        is_early = -limit < excess < MAX_EXCESS
        is_expected = is_early or (self._blocks < MIN_BLOCKS and excess < limit)
        interval = self.interval
        if self.frame_samples > 1 and not skipped and is_expected:
            interval = advance / self.frame_samples
            self._blocks += 1
            self.interval += (SMOOTHING_FACTOR if self._blocks > 1 else 1.0) * (interval - self.interval)
        if self.pending:
            self.pending[-1].interval = interval
        gap = advance - (self.frame_samples - 1) * interval
        return 1.0 if self.frame_samples > 1 and not skipped and is_expected else gap / stated


@dataclass(frozen=True)
class Marker:
    """Instant marked by the user or by the logger; t [s] on the session's clock, None before its first sample."""

    segment: int | None
    t: float | None
    source: str
    text: str
    utc: float | None = None


def decode_rows(hello: Hello, frames: list[PendingSamples]) -> Rows:
    """Decode the samples of frames."""
    return Rows(_sample_times(frames), _sample_values(hello, frames))


def _sample_times(pending: list[PendingSamples]) -> FloatArray:
    """Return the times [s] of all samples of frames."""
    counts = np.array([frame.count for frame in pending])
    first = np.repeat(np.array([frame.t for frame in pending], dtype=np.float64), counts)
    interval = np.repeat(np.array([frame.interval for frame in pending], dtype=np.float64), counts)
    index = np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.asarray(first + index * interval)


def _sample_values(hello: Hello, pending: list[PendingSamples]) -> FloatArray:
    """Return the values [sample, channel] of all samples of frames."""
    parts = [frame.data for frame in pending if isinstance(frame.data, bytes)]
    if parts:
        return hello.decode_samples(b"".join(parts))
    return hello.to_physical(np.array([frame.data for frame in pending], dtype=np.float64))
