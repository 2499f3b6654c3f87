"""Sessions from frames: unwrap numbers and times, count gaps, start a session at every change of the logger."""

from __future__ import annotations

from railui.capture.protocol.link import Link, LinkStatistics
from railui.capture.protocol.messages import Frame, Hello, Mark, Samples, Status
from railui.capture.recorder.clock import COUNTER_PERIOD, LoggerClock
from railui.capture.recorder.postponed_frames import PostponedFrames
from railui.capture.recorder.restart_watch import RestartWatch
from railui.capture.recorder.sessions import LoggerSession, Marker, PendingSamples, RecordingCounts, Rows, decode_rows
from railui.runs.segments import GAP_INTERVALS

MAX_LOST_AFTER_RESTART = 1000  # frames; a higher number is where the logger began to count, not a loss
MICROSECONDS = 1e6
MIN_FORWARD_JUMP = 1.0  # s
DecodedRows = list[tuple[LoggerSession, Rows]]


class SessionAssembler:
    """Assembly of sessions with rows from the bytes and events of a recording; the result depends on these alone."""

    def __init__(self) -> None:
        self.counts = RecordingCounts()
        self.sessions: list[LoggerSession] = []
        self.markers: list[Marker] = []
        self._closed_links = LinkStatistics()
        self._link = Link()
        self._session: LoggerSession | None = None
        self._boot: int | None = None
        self._next_number: int | None = None
        self._is_restarted = False
        self._starts = 0
        self._watch = RestartWatch()
        self._clock = LoggerClock()
        self._postponed = PostponedFrames()
        self._reason = "begin"
        self._overruns: int | None = None

    # -- events

    def feed(self, data: bytes) -> DecodedRows:
        """Return the rows that these bytes complete, in their order."""
        rows: DecodedRows = []
        for frame in self._link.feed(data):
            self._process(frame, rows)
        self._decode_pending(rows)
        return rows

    def reconnect(self) -> DecodedRows:
        """Start a session with the next hello, after the link was interrupted; return the last rows before."""
        rows = self.close()
        self.counts.reconnects += 1
        self._reason = "reconnect"
        return rows

    def add_marker(self, text: str) -> None:
        """Add a marker of the user at the newest sample."""
        session = self._session
        number, t = (session.number, session.last_time) if session else (None, None)
        self.markers.append(Marker(number, t, "typed", text))

    def close(self) -> DecodedRows:
        """End the recording; return the last rows."""
        rows: DecodedRows = []
        self._decode_pending(rows, keep_newest=False)
        self._close_link()
        return rows

    # -- state

    def link_statistics(self) -> LinkStatistics:
        """Return the frame counts of all connections so far."""
        total = LinkStatistics()
        total.add(self._closed_links)
        total.add(self._link.statistics)
        return total

    @property
    def form(self) -> str | None:
        """Form of the frames, binary or text; None before the first valid frame."""
        return self._link.form

    @property
    def newest_sample(self) -> tuple[int, float] | None:
        """Start of the logger and time [s] of the newest sample."""
        if self._session is None or self._session.last_time is None:
            return None
        return self._session.start, self._session.last_time

    @property
    def next_frame_number(self) -> int | None:
        """Expected number of the next frame, None before the first."""
        return self._next_number

    @property
    def pending_bytes(self) -> int:
        """Bytes of frames that wait for their hello."""
        return self._postponed.bytes

    # -- frames

    def _process(self, frame: Frame, rows: DecodedRows) -> None:
        if isinstance(frame, Hello):
            if self._session is None or not _is_same_logger(frame, self._session.hello):
                self._decode_pending(rows, keep_newest=False)
                self._begin_session(frame)
                self._process_postponed(frame.layout, rows)
            if self._count_frame(frame.number) is None:
                self._process_late(frame, rows)
        elif self._session is not None and frame.layout == self._session.hello.layout:
            self._process_in_session(self._session, frame, rows)
        else:
            self._postpone(frame)

    def _process_in_session(self, session: LoggerSession, frame: Frame, rows: DecodedRows) -> None:
        skipped = self._count_frame(frame.number)
        if skipped is None:
            self._process_late(frame, rows)
        elif isinstance(frame, Samples):
            self._add_samples(session, frame, skipped, rows)
        elif isinstance(frame, Status):
            self._add_status(session, frame)
        elif isinstance(frame, Mark):
            t = self._session_time(session, frame.time)
            self.markers.append(Marker(session.number, t, frame.source, frame.label, frame.utc or None))

    def _count_frame(self, number: int) -> int | None:
        """Count the frames lost before this one and return their number; None if the frame is repeated."""
        if self._next_number is None or (self._is_restarted and number > MAX_LOST_AFTER_RESTART):
            self._next_number = number
        self._is_restarted = False
        skipped = (number - self._next_number) % COUNTER_PERIOD
        if skipped >= COUNTER_PERIOD // 2:
            self.counts.repeated_frames += 1
            return None
        self._next_number = (number + 1) % COUNTER_PERIOD
        self.counts.lost_frames += skipped
        self._watch.clear()
        return skipped

    def _process_late(self, frame: Frame, rows: DecodedRows) -> None:
        """Process a frame whose number ran back: a repetition, unless it shows a restart with the same boot."""
        frames = self._watch.add(frame)
        session = self._session
        if not frames or session is None:
            return
        self.counts.repeated_frames -= len(frames)
        self._decode_pending(rows, keep_newest=False)
        self._count_restart()
        self._reason = "restart"
        self._begin_session(session.hello)
        for each in frames:
            self._process(each, rows)

    def _add_status(self, session: LoggerSession, frame: Status) -> None:
        previous = self._overruns if self._overruns is not None else frame.overruns
        self.counts.overruns += (frame.overruns - previous) % COUNTER_PERIOD
        self._overruns = frame.overruns
        session.status = {"temperature": frame.temperature, "battery": frame.battery}

    def _session_time(self, session: LoggerSession, time: int) -> float | None:
        """Return the session time [s] of an instant [us, wrapped] near the newest sample."""
        now = self._clock.now
        if now is None:
            return None
        half = COUNTER_PERIOD // 2
        return (now + (time - now + half) % COUNTER_PERIOD - half - session.origin) * 1e-6

    # -- samples

    def _add_samples(self, session: LoggerSession, frame: Samples, skipped: int, rows: DecodedRows) -> None:
        count = self._checked_count(session.hello, frame)
        if not count:
            return
        rate = session.hello.rate
        stated = (skipped + 1) * max(session.frame_samples, 1) * MICROSECONDS / rate
        time = self._clock.unwrap(frame.time, self._clock.expected_advance(frame.number, stated))
        if time is None:
            session = self._begin_after_clock_jump(session, rows)
            time = frame.time
        if self._clock.origin is None:
            session.origin = time
        t = (time - session.origin) * 1e-6
        if session.first_time is not None:
            steps = session.space_newest_frame(t, skipped)
            if steps <= 0:
                self._refuse(f"a time stamp {-1e3 * steps / rate:.3g} ms before that of the previous sample")
                return
            if steps > GAP_INTERVALS:
                self._count_gap(session, round(steps) - 1, skipped)
        session.first_time = t if session.first_time is None else session.first_time
        session.frame_time = t
        session.frame_samples = count
        session.samples += count
        self.counts.samples += count
        self._clock.set(time, frame.number)
        session.pending.append(PendingSamples(t, count, session.interval, frame.data))

    def _checked_count(self, hello: Hello, frame: Samples) -> int:
        """Return the number of samples of a frame; refuse it and return 0 if its data contradict the hello."""
        size = hello.sample_dtype.itemsize
        if isinstance(frame.data, bytes):
            fits = len(frame.data) == frame.sample_count * size
        else:
            fits = len(frame.data) == len(hello.channels)
        if fits:
            return frame.sample_count
        content = f"{len(frame.data)} {'bytes' if isinstance(frame.data, bytes) else 'values'}"
        expected = f"{frame.sample_count} samples of {size} bytes, {len(hello.channels)} channels"
        self._refuse(f"{content} instead of {expected}")
        return 0

    def _begin_after_clock_jump(self, session: LoggerSession, rows: DecodedRows) -> LoggerSession:
        self._decode_pending(rows, keep_newest=False)
        self.counts.clock_jumps += 1
        self._clock = LoggerClock()
        self._starts += 1
        self._reason = "the logger's clock ran back"
        return self._begin_session(session.hello)

    def _count_gap(self, session: LoggerSession, missing: int, skipped: int) -> None:
        if not skipped and missing > MIN_FORWARD_JUMP * session.hello.rate:
            self.counts.forward_jumps += 1
        session.gaps += 1
        session.missing_samples += missing
        self.counts.gaps += 1
        self.counts.missing_samples += missing

    def _decode_pending(self, rows: DecodedRows, keep_newest: bool = True) -> None:
        """Decode the pending samples of the session to rows; the newest block waits for the stamp of the next one."""
        session = self._session
        if session is None or not session.pending:
            return
        is_kept = keep_newest and session.pending[-1].count > 1
        pending = session.pending[:-1] if is_kept else session.pending
        session.pending = session.pending[len(pending) :]
        if not pending:
            return
        rows.append((session, decode_rows(session.hello, pending)))

    # -- sessions

    def _begin_session(self, hello: Hello) -> LoggerSession:
        reason = self._reason
        if self._boot is not None and hello.boot != self._boot:
            reason = "restart" if self._session is not None else "reconnect after a restart"
            self._count_restart()
        elif self._session is None and self._ran_back(hello.number):
            reason = "reconnect after a restart"
            self._count_restart()
        elif self._session is not None and not _is_same_logger(hello, self._session.hello):
            self.counts.layout_changes += 1
            reason = "other channels"
        self._boot = hello.boot
        self._reason = "begin"
        session = LoggerSession(len(self.sessions) + 1, hello, reason, self._clock.origin or 0, self._starts)
        self.sessions.append(session)
        self._session = session
        return session

    def _ran_back(self, number: int) -> bool:
        next_number = self._next_number
        return next_number is not None and (number - next_number) % COUNTER_PERIOD >= COUNTER_PERIOD // 2

    def _count_restart(self) -> None:
        self.counts.restarts += 1
        self._starts += 1
        self._watch.clear()
        self._next_number = 0 if self._session is not None else None
        self._is_restarted = True
        self._clock = LoggerClock()
        self._overruns = None

    def _close_link(self) -> None:
        self._closed_links.add(self._link.close())
        self._link = Link()
        self.counts.frames_without_hello += len(self._postponed.take())
        self._session = None

    def _postpone(self, frame: Frame) -> None:
        """Store a frame until its hello arrives."""
        self.counts.frames_without_hello += self._postponed.add(frame)

    def _process_postponed(self, layout: int, rows: DecodedRows) -> None:
        """Process the stored frames of a layout."""
        for frame in self._postponed.take():
            if frame.layout == layout and self._session is not None:
                self._process_in_session(self._session, frame, rows)
            else:
                self._postpone(frame)

    def _refuse(self, reason: str) -> None:
        self._link.statistics.add_refusal(reason)


def _is_same_logger(a: Hello, b: Hello) -> bool:
    return (a.layout, a.boot, a.rate, a.channels) == (b.layout, b.boot, b.rate, b.channels)
