"""Recording of a serial logger for the strip chart: newest rows, counters, markers."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.api.recordings import write_capture_report
from railui.arrays import FloatArray
from railui.capture.protocol.load import link_load
from railui.capture.protocol.messages import Channel
from railui.capture.recorder.record import Recorder
from railui.capture.recorder.replay import Replay
from railui.capture.recorder.sessions import LoggerSession, Rows
from railui.capture.simulator.demo_logger import DemoLogger
from railui.desk.presenters.choices import DEMO_PORT

CHART_SECONDS: Final = 30.0  # s of rows that a status has: the longest strip chart
MAX_BUFFERED_ROWS: Final = 40_000


@dataclass(frozen=True, eq=False)
class RecordingStatus:
    """Status of a recording: channels of the newest logger session and its rows of the last CHART_SECONDS.

    t [n] in s, values [n, channel]; rate in Hz; link_load is the used fraction of the serial link; full_scales: largest
    value of each channel's numbers, NaN where they have no end; clipped: names of clipped channels; link_fault: likely
    cause where no bytes or no intact frames arrive.
    """

    t: FloatArray
    values: FloatArray
    counts: dict[str, int]
    seconds: float
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    rate: float = 0.0
    link_load: float | None = None
    markers: tuple[tuple[float, str], ...] = ()
    status: dict[str, float | None] = field(default_factory=dict)
    device: str = ""
    full_scales: tuple[float, ...] = ()
    clipped: frozenset[str] = frozenset()
    link_fault: str = ""


class RecordingBuffer:
    """Newest rows of a recording, filled by the decoding thread."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.session: LoggerSession | None = None
        self.blocks: deque[Rows] = deque()
        self.row_count = 0

    def append(self, session: LoggerSession, rows: Rows) -> None:
        """Append decoded rows and drop the oldest blocks beyond MAX_BUFFERED_ROWS."""
        with self.lock:
            if session is not self.session:
                self.session = session
                self.row_count = 0
                self.blocks.clear()
            self.blocks.append(rows)
            self.row_count += len(rows.t)
            while self.row_count - len(self.blocks[0].t) > MAX_BUFFERED_ROWS:
                self.row_count -= len(self.blocks.popleft().t)

    def latest(self, seconds: float) -> tuple[LoggerSession | None, FloatArray, FloatArray]:
        """Return the newest session and its last seconds: t [n], values [n, channel]."""
        with self.lock:
            if self.session is None or not self.blocks:
                return self.session, np.zeros(0), np.zeros((0, 0))
            t = np.concatenate([rows.t for rows in self.blocks])
            values = np.concatenate([rows.values for rows in self.blocks])
        is_recent = t >= t[-1] - seconds
        return self.session, t[is_recent], values[is_recent]


class DeskRecording:
    """Recording of a port, or of the demo logger, into a directory.

    `recorder` is None before the port is open and after the end.
    """

    def __init__(self, port: str, baud: int, directory: Path, on_message: Callable[[str], None]) -> None:
        self.port = port
        self.baud = baud
        self.directory = directory
        self.on_message = on_message
        self.recorder: Recorder | None = None
        self.report: dict[str, Any] = {}

    def run(self, stop_requested: threading.Event) -> Iterator[RecordingStatus]:
        """Record until a stop is requested; yield the status four times a second."""
        with ExitStack() as stack:
            port = stack.enter_context(DemoLogger()).port if self.port == DEMO_PORT else self.port
            recorder = Recorder(port, self.baud, self.directory, self.on_message)
            buffer = RecordingBuffer()
            recorder.replay.on_rows = buffer.append
            self.recorder = recorder
            for replay in recorder.run():
                if stop_requested.is_set():
                    recorder.stop()
                yield replace(recording_status(replay, buffer, self.baud), link_fault=recorder.link_fault() or "")
            self.recorder = None
            self.report = write_capture_report(recorder.replay.report(), self.directory)


def recording_status(replay: Replay, buffer: RecordingBuffer, baud: int) -> RecordingStatus:
    """Return the current status of a recording; called on its own thread."""
    session, t, values = buffer.latest(CHART_SECONDS)
    newest = replay.assembler.newest_sample
    seconds = newest[1] if newest else 0.0
    if session is None:
        return RecordingStatus(t, values, _counts(replay), seconds)
    hello = session.hello
    samples_per_frame, form = max(session.frame_samples, 1), replay.assembler.form or "binary"
    load = link_load(list(hello.channels), hello.rate, baud, samples_per_frame, form)
    markers = [m for m in replay.assembler.markers if m.t is not None and m.segment == session.number]
    return RecordingStatus(
        t,
        values,
        _counts(replay),
        seconds,
        names=tuple(channel.name for channel in hello.channels),
        units=tuple(channel.unit for channel in hello.channels),
        rate=hello.rate,
        link_load=load.utilisation,
        markers=tuple((m.t, m.text) for m in markers if m.t is not None),
        status=dict(session.status),
        device=hello.device,
        full_scales=tuple(full_scale(channel) for channel in hello.channels),
        clipped=frozenset(name for number, name in replay.clipped_channels() if number == session.number),
    )


def full_scale(channel: Channel) -> float:
    """Return the largest magnitude [unit of the channel] that its numbers can have, NaN for floating-point numbers.

    >>> full_scale(Channel("c", "m/s^2", "h", 0.001))
    32.767
    """
    if channel.type == "f":
        return math.nan
    limits = np.iinfo(np.dtype(channel.type))
    return max(abs(channel.scale * end + channel.offset) for end in (max(limits.min, -limits.max), limits.max))


def _counts(replay: Replay) -> dict[str, int]:
    counts = replay.assembler.counts
    link = replay.assembler.link_statistics()
    return {
        "samples": counts.samples,
        "frames": link.frames,
        "lost": counts.lost_frames,
        "missing": counts.missing_samples,
        "crc errors": link.crc_errors,
        "gaps": counts.gaps,
        "reconnects": counts.reconnects,
        "overruns": counts.overruns,
        "queue": replay.highest_queue,
    }
