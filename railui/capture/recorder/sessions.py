"""Contents of a recording: sessions with their rows, markers, and counts."""

from __future__ import annotations

from dataclasses import dataclass, field

from railui.arrays import FloatArray
from railui.capture.protocol.frames import Hello

# the interval inside blocks follows the logger's clock: exponential smoothing over long blocks with a plausible rate
MIN_BLOCK_SAMPLES = 8
MAX_RATE_DEVIATION = 0.02  # relative to the stated rate
SMOOTHING_FACTOR = 0.1


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
    frames_without_hello: int = 0


@dataclass(frozen=True, eq=False)
class Rows:
    """Decoded samples of one session: t [n] in s of the logger's clock, values [n, channel]."""

    t: FloatArray
    values: FloatArray


@dataclass(frozen=True)
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
    frame_time, frame_samples
        Time of the first sample of the newest frame [s], and its number of samples.
    interval
        Time between the samples of a block [s].
    """

    number: int
    hello: Hello
    reason: str
    origin: int
    first_time: float | None = None
    last_time: float | None = None
    samples: int = 0
    gaps: int = 0
    missing_samples: int = 0
    status: dict[str, float | None] = field(default_factory=dict)
    pending: list[PendingSamples] = field(default_factory=list, repr=False)
    frame_time: float = 0.0
    frame_samples: int = 0
    interval: float = 0.0

    def update_interval(self, t: float, skipped: int) -> float:
        """Return the interval [s] inside blocks, updated by the time `t` [s] of a block after `skipped` lost ones.

        It begins with the stated rate and follows the logger's clock as consecutive blocks show it.
        """
        stated = 1.0 / self.hello.rate
        self.interval = self.interval or stated
        if self.frame_samples >= MIN_BLOCK_SAMPLES and not skipped:
            observed = (t - self.frame_time) / self.frame_samples
            if abs(observed / stated - 1) < MAX_RATE_DEVIATION:
                self.interval += SMOOTHING_FACTOR * (observed - self.interval)
        return self.interval


@dataclass(frozen=True)
class Marker:
    """Instant marked by the user or by the logger; t [s] on the session's clock, None before its first sample."""

    segment: int | None
    t: float | None
    source: str
    text: str
    utc: float | None = None
