"""Frames to segments: numbers and times unwrapped, gaps found, a new segment wherever the logger is another one."""

from __future__ import annotations

from collections import deque

import numpy as np

from railui.capture.protocol.frames import Frame, Hello, Mark, Samples, Status
from railui.capture.protocol.link import Heard, Link
from railui.capture.recorder.clock import WRAP, Clock
from railui.capture.recorder.segments import Counts, Marker, Rows, Segment

MOST_HELD = 1 << 20  # bytes of samples that wait for their hello
GAP = 1.5  # intervals
MOST_SILENT = 1000  # frames after a restart that count as lost: a logger that begins elsewhere lost none


class Assembly:
    """Bytes and events of a recording in their order, to segments with rows; the same in, the same out."""

    def __init__(self) -> None:
        self.counts = Counts()
        self.segments: list[Segment] = []
        self.markers: list[Marker] = []
        self.heard = Heard()
        self._link = Link()
        self._open: Segment | None = None
        self._boot: int | None = None
        self._expected: int | None = None
        self._fresh = False
        self._clock = Clock()
        self._held: deque[Frame] = deque()
        self._held_bytes = 0
        self._why = "begin"
        self._overruns: int | None = None

    # -- what arrives

    def feed(self, data: bytes) -> list[tuple[Segment, Rows]]:
        """The rows that these bytes complete, in their order."""
        done: list[tuple[Segment, Rows]] = []
        for frame in self._link.feed(data):
            self._take(frame, done)
        self._flush(done)
        return done

    def reconnect(self) -> None:
        """The link was lost and is there again: a new segment begins with what it says."""
        self._hang_up()
        self._link = Link()
        self.counts.reconnects += 1
        self._why = "reconnect"

    def marker(self, text: str) -> None:
        """Somebody marks this instant by hand."""
        here = self._open
        self.markers.append(Marker(here.number if here else None, here.last if here else None, "typed", text))

    def close(self) -> None:
        """The recording ends."""
        self._hang_up()

    def total(self) -> Heard:
        """What was heard on all connections so far."""
        found = Heard()
        found.add(self.heard)
        found.add(self._link.heard)
        return found

    @property
    def form(self) -> str | None:
        """binary or text, None before the first whole frame."""
        return self._link.form

    @property
    def newest(self) -> tuple[int, float] | None:
        """Boot and time [s] of the newest sample."""
        if self._open is None or self._open.last is None:
            return None
        return self._open.hello.boot, self._open.last

    # -- frames

    def _take(self, frame: Frame, done: list[tuple[Segment, Rows]]) -> None:
        if isinstance(frame, Hello):
            if self._open is None or not _same(frame, self._open.hello):
                self._flush(done)
                self._begin(frame)
                self._unhold(frame.layout, done)
            self._numbered(frame.number)
        elif self._open is not None and frame.layout == self._open.hello.layout:
            self._known(self._open, frame, done)
        else:
            self._hold(frame)

    def _known(self, segment: Segment, frame: Frame, done: list[tuple[Segment, Rows]]) -> None:
        skipped = self._numbered(frame.number)
        if skipped is None:
            return
        if isinstance(frame, Samples):
            self._sampled(segment, frame, skipped, done)
        elif isinstance(frame, Status):
            self._state(segment, frame)
        elif isinstance(frame, Mark):
            at = self._since(segment, frame.time)
            self.markers.append(Marker(segment.number, at, frame.source, frame.label, frame.utc or None))

    def _numbered(self, number: int) -> int | None:
        """How many frames are missing before this one; None where it was there already."""
        if self._expected is None or (self._fresh and number > MOST_SILENT):
            self._expected = number
        self._fresh = False
        skipped = (number - self._expected) % WRAP
        if skipped >= WRAP // 2:
            self.counts.repeated += 1
            return None
        self._expected = (number + 1) % WRAP
        self.counts.lost += skipped
        return skipped

    def _state(self, segment: Segment, frame: Status) -> None:
        grown = frame.overruns - (self._overruns if self._overruns is not None else frame.overruns)
        self.counts.overruns += grown % WRAP
        self._overruns = frame.overruns
        segment.status = {"temperature": frame.temperature, "battery": frame.battery}

    def _since(self, segment: Segment, time: int) -> float | None:
        """When an instant near the newest sample was, before or after it."""
        now = self._clock.now
        if now is None:
            return None
        return (now + (time - now + WRAP // 2) % WRAP - WRAP // 2 - segment.origin) * 1e-6

    # -- samples

    def _sampled(self, segment: Segment, frame: Samples, skipped: int, done: list[tuple[Segment, Rows]]) -> None:
        count = self._counted(segment.hello, frame)
        if not count:
            return
        rate = segment.hello.rate
        time = self._clock.unwrapped(frame.time, (skipped * count + 1) * 1e6 / rate)
        if time is None:
            segment, time = self._ran_back(segment, done), frame.time
        if self._clock.origin is None:
            self._clock.origin = segment.origin = time
        t = (time - segment.origin) * 1e-6
        interval = segment.follow(t, skipped)
        if segment.last is not None:
            steps = (t - segment.last) * rate
            if steps <= 0:
                self._refuse(f"a time stamp {-1e3 * steps / rate:.3g} ms before the sample ahead of it")
                return
            if steps > GAP:
                self._gap(segment, round(steps) - 1)
        segment.first = t if segment.first is None else segment.first
        segment.begun, segment.count = t, count
        segment.last = t + (count - 1) * interval
        segment.samples += count
        self.counts.samples += count
        self._clock.now = time + round((count - 1) * interval * 1e6)
        segment.waiting.append((t, count, interval, frame.data))

    def _counted(self, hello: Hello, frame: Samples) -> int:
        """How many samples a frame holds; 0, and told, where it does not fit the hello."""
        said = frame.held
        if isinstance(frame.data, bytes):
            fits = len(frame.data) == said * hello.row.itemsize
        else:
            fits = len(frame.data) == len(hello.channels)
        if not fits:
            held = f"{len(frame.data)} {'bytes' if isinstance(frame.data, bytes) else 'values'}"
            self._refuse(f"{held} are not {said} samples of {hello.row.itemsize} bytes, {len(hello.channels)} channels")
        return said if fits else 0

    def _ran_back(self, segment: Segment, done: list[tuple[Segment, Rows]]) -> Segment:
        self._flush(done)
        self.counts.clock_jumps += 1
        self._clock = Clock()
        self._why = "the logger's clock ran back"
        return self._begin(segment.hello)

    def _gap(self, segment: Segment, missing: int) -> None:
        segment.gaps += 1
        segment.missing += missing
        self.counts.gaps += 1
        self.counts.missing += missing

    def _flush(self, done: list[tuple[Segment, Rows]]) -> None:
        """The waiting samples of the open segment as rows."""
        segment = self._open
        if segment is None or not segment.waiting:
            return
        begun, counts, intervals, data = zip(*segment.waiting, strict=True)
        segment.waiting = []
        hello = segment.hello
        if isinstance(data[0], bytes):
            values = hello.values(b"".join(data))
        else:
            values = hello.scaled(np.array(data, dtype=np.float64))
        first, step = (np.repeat(np.array(x, dtype=np.float64), counts) for x in (begun, intervals))
        inside = np.arange(len(values)) - np.repeat(np.cumsum(counts) - counts, counts)
        done.append((segment, Rows(first + inside * step, values)))

    # -- segments

    def _begin(self, hello: Hello) -> Segment:
        why = self._why
        if self._boot is not None and hello.boot != self._boot:
            self.counts.restarts += 1
            why = "restart" if self._open is not None else "reconnect after a restart"
            self._expected = 0 if self._open is not None else None
            self._fresh = True
            self._clock, self._overruns = Clock(), None
        elif self._open is not None and not _same(hello, self._open.hello):
            self.counts.relayouts += 1
            why = "other channels"
        self._boot, self._why = hello.boot, "begin"
        segment = Segment(len(self.segments) + 1, hello, why, self._clock.origin or 0)
        self.segments.append(segment)
        self._open = segment
        return segment

    def _hang_up(self) -> None:
        self.heard.add(self._link.close())
        self._link = Link()
        self.counts.unnamed += len(self._held)
        self._held.clear()
        self._held_bytes = 0
        self._open = None

    def _hold(self, frame: Frame) -> None:
        """Keeps a frame whose hello has not come yet."""
        self._held.append(frame)
        self._held_bytes += _size(frame)
        while self._held_bytes > MOST_HELD:
            self._held_bytes -= _size(self._held.popleft())
            self.counts.unnamed += 1

    def _unhold(self, layout: int, done: list[tuple[Segment, Rows]]) -> None:
        held, self._held, self._held_bytes = self._held, deque(), 0
        for frame in held:
            if frame.layout == layout and self._open is not None:
                self._known(self._open, frame, done)
            else:
                self._hold(frame)

    def _refuse(self, reason: str) -> None:
        self._link.heard.refuse(reason)


def _same(a: Hello, b: Hello) -> bool:
    return (a.layout, a.boot, a.rate, a.channels) == (b.layout, b.boot, b.rate, b.channels)


def _size(frame: Frame) -> int:
    return 64 + (len(frame.data) * (1 if isinstance(frame.data, bytes) else 8) if isinstance(frame, Samples) else 0)
