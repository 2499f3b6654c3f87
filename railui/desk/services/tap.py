"""What is seen of a recording while it goes on: its last rows, its counters, its marks."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.capture.protocol.load import link_load
from railui.capture.recorder.replay import Replay
from railui.capture.recorder.segments import Rows, Segment

WINDOW = 10.0  # s of the strip chart
KEPT = 40_000  # rows in memory


@dataclass(frozen=True, eq=False)
class State:
    """What is told of a recording four times a second; channels of the newest segment, rows of its last seconds."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    t: FloatArray
    values: FloatArray
    rate: float
    load: float | None
    counts: dict[str, int]
    seconds: float
    marks: tuple[tuple[float, str], ...]
    status: dict[str, float | None]
    device: str


class Tap:
    """The last rows of what is being recorded, filled by the thread that decodes."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.segment: Segment | None = None
        self.blocks: deque[Rows] = deque()
        self.rows = 0

    def take(self, segment: Segment, rows: Rows) -> None:
        """Rows as they are decoded."""
        with self.lock:
            if segment is not self.segment:
                self.segment, self.rows = segment, 0
                self.blocks.clear()
            self.blocks.append(rows)
            self.rows += len(rows.t)
            while self.rows - len(self.blocks[0].t) > KEPT:
                self.rows -= len(self.blocks.popleft().t)

    def last(self, seconds: float) -> tuple[Segment | None, FloatArray, FloatArray]:
        """The newest segment and its last seconds: t [n], values [n, channel]."""
        with self.lock:
            if self.segment is None or not self.blocks:
                return self.segment, np.zeros(0), np.zeros((0, 0))
            t = np.concatenate([rows.t for rows in self.blocks])
            values = np.concatenate([rows.values for rows in self.blocks])
        kept = t >= t[-1] - seconds
        return self.segment, t[kept], values[kept]


def state_of(replay: Replay, tap: Tap, baud: int) -> State:
    """Where a recording stands; called in its own thread."""
    counts, heard = replay.assembly.counts, replay.assembly.total()
    segment, t, values = tap.last(WINDOW)
    numbers = {
        "samples": counts.samples, "frames": heard.frames, "lost": counts.lost, "missing": counts.missing,
        "crc errors": heard.crc_errors, "gaps": counts.gaps, "reconnects": counts.reconnects,
        "overruns": counts.overruns, "queue": replay.highest_queue,
    }  # fmt: skip
    seconds = replay.assembly.newest[1] if replay.assembly.newest else 0.0
    if segment is None:
        return State((), (), t, values, 0.0, None, numbers, seconds, (), {}, "")
    hello = segment.hello
    load = link_load(list(hello.channels), hello.rate, baud).share
    marks = tuple((m.t, m.text) for m in replay.assembly.markers if m.t is not None and m.segment == segment.number)
    return State(
        tuple(c.name for c in hello.channels), tuple(c.unit for c in hello.channels), t, values, hello.rate, load,
        numbers, seconds, marks, dict(segment.status), hello.device,
    )  # fmt: skip
