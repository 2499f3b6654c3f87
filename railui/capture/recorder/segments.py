"""What a recording consists of: segments with their rows, markers, and what is counted."""

from __future__ import annotations

from dataclasses import dataclass, field

from railui.arrays import FloatArray
from railui.capture.protocol.frames import Hello

EVEN, SMOOTH, BLOCK = 0.02, 0.1, 8  # a rate off by less is followed, by this share of each block of so many samples


@dataclass
class Counts:
    """What a recording is told by; `lost` frames by their numbers, `missing` samples by their times."""

    lost: int = 0
    repeated: int = 0
    samples: int = 0
    gaps: int = 0
    missing: int = 0
    overruns: int = 0
    reconnects: int = 0
    restarts: int = 0
    relayouts: int = 0
    clock_jumps: int = 0
    unnamed: int = 0  # frames whose hello never came


@dataclass(frozen=True, eq=False)
class Rows:
    """Decoded samples of one segment: t [n] in s of the logger's clock, values [n, channel]."""

    t: FloatArray
    values: FloatArray


@dataclass(eq=False)
class Segment:
    """An unbroken acquaintance with a logger: one connection, one start, one layout."""

    number: int
    hello: Hello
    why: str
    origin: int  # us: where t = 0 lies on the unwrapped clock
    first: float | None = None
    last: float | None = None
    samples: int = 0
    gaps: int = 0
    missing: int = 0
    status: dict[str, float | None] = field(default_factory=dict)
    waiting: list[tuple[float, int, float, bytes | tuple[float, ...]]] = field(default_factory=list, repr=False)
    begun: float = 0.0  # of the newest frame: t of its first sample, how many it holds
    count: int = 0
    interval: float = 0.0  # s between samples inside a block

    def follow(self, t: float, skipped: int) -> float:
        """The interval [s] inside blocks: as stated, and as unbroken blocks show it where their clock differs."""
        stated = 1.0 / self.hello.rate
        self.interval = self.interval or stated
        if self.count >= BLOCK and not skipped:
            shown = (t - self.begun) / self.count
            if abs(shown / stated - 1) < EVEN:
                self.interval += SMOOTH * (shown - self.interval)
        return self.interval


@dataclass(frozen=True)
class Marker:
    """An instant that somebody marked: by hand, or by the logger; t [s] of the segment's clock, None before it."""

    segment: int | None
    t: float | None
    source: str
    text: str
    utc: float | None = None
