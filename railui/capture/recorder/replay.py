"""Raw bytes and journal to runs, during a recording and afterwards by the same code."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from railui.capture.recorder.clock import ClockFit, fit_clock
from railui.capture.recorder.journal import JOURNAL_FILE, Event, read_journal
from railui.capture.recorder.link_watch import MAX_SILENCE, MAX_UNDECODED_BYTES
from railui.capture.recorder.run_files import RunFiles, run_file_name
from railui.capture.recorder.session_assembler import SessionAssembler
from railui.capture.recorder.sessions import LoggerSession, Rows
from railui.runs.clipping import ClippingWatch

RAW_FILE = "raw.bin"
CHUNK_BYTES = 1 << 16
NO_SILENCE = (0.0, 0.0)  # s
ClockPoint = tuple[
    int, float, float
]  # start of the logger, time of the newest sample [s], monotonic time of the host [s]


def _ignore_rows(session: LoggerSession, rows: Rows) -> None:
    """Ignore rows."""


class Replay:
    """Decoder of raw bytes on the disk, with the journal's events between them; writes the runs.

    Attributes
    ----------
    position
        Decoded raw bytes.
    on_rows
        Receiver of the rows of each session as they are decoded.
    clock_points
        Times of the logger and the host, per start of the logger.
    silence
        Longest time without a byte, and its end after the start of the recording [s]; None where no journal states it.
    wall_clock_anchor
        Calendar time and monotonic time of the host [s] at the start.
    """

    def __init__(self, raw: Path, directory: Path) -> None:
        self.assembler = SessionAssembler()
        self.files = RunFiles(directory)
        self.position = 0
        self.highest_queue = 0
        self.clock_points: list[ClockPoint] = []
        self.wall_clock_anchor: tuple[float, float] | None = None
        self.dropped_bytes = 0
        self.silence: tuple[float, float] | None = None
        self.on_rows: Callable[[LoggerSession, Rows], None] = _ignore_rows
        self._clipping: dict[int, ClippingWatch] = {}
        self._events: deque[Event] = deque()
        self._raw = raw.open("rb")

    def add_events(self, events: Iterable[Event]) -> None:
        """Append events in their order."""
        self._events += events

    def advance(self, size: int) -> bool:
        """Decode up to a number of raw bytes; return False if the disk is full and the runs must wait."""
        while self.files.write_pending():
            while self._events and self._events[0]["at"] <= self.position:
                self._apply(self._events.popleft())
            end = min([size, self.position + CHUNK_BYTES] + [e["at"] for e in list(self._events)[:1]])
            if end <= self.position:
                return True
            data = self._raw.read(end - self.position)
            if not data:
                return True
            self.position += len(data)
            self._add_rows(self.assembler.feed(data))
        return False

    def _add_rows(self, decoded: Iterable[tuple[LoggerSession, Rows]]) -> None:
        for session, rows in decoded:
            self.files.add(session, rows)
            watch = self._clipping.setdefault(session.number, ClippingWatch(rows.values.shape[1]))
            watch.add(rows.values)
            self.on_rows(session, rows)

    def close(self) -> None:
        """End the recording; rows that a full disk still refuses are lost."""
        self._add_rows(self.assembler.close())
        self.files.write_pending()
        self.files.close()
        self._raw.close()

    def _apply(self, event: Event) -> None:
        kind = event["event"]
        newest = self.assembler.newest_sample
        # a sample is as old as the silence before any other event
        is_new = newest is not None and (not self.clock_points or self.clock_points[-1][:2] != newest)
        if newest is not None and is_new and "mono" in event and kind == "tick":
            self.clock_points.append((*newest, float(event["mono"])))
        if kind == "reopen":
            self._add_rows(self.assembler.reconnect())
        elif kind == "marker":
            self.assembler.add_marker(str(event.get("text", "")))
        elif kind == "dropped":
            self.dropped_bytes += int(event.get("bytes", 0))
        elif kind == "silent" and self.wall_clock_anchor is not None:
            end = float(event["mono"]) - self.wall_clock_anchor[1]
            self.silence = max(self.silence or NO_SILENCE, (float(event["seconds"]), end))
        elif kind == "open" and "wall_s" in event:
            self.wall_clock_anchor = float(event["wall_s"]), float(event["mono"])
            self.silence = NO_SILENCE

    # -- report

    def clipped_channels(self) -> dict[tuple[int, str], tuple[int, str]]:
        """Return samples and level of the clipped channels, by segment and name."""
        found = {}
        for session in self.assembler.sessions:
            watch = self._clipping.get(session.number)
            for i, (samples, level) in (watch.clipped() if watch else {}).items():
                channel = session.hello.channels[i]
                found[session.number, channel.name] = samples, f"{level:.4g} {channel.unit}".strip()
        return found

    def fit_clocks(self) -> dict[int, ClockFit | None]:
        """Fit the logger's clock against the host's, per start of the logger."""
        starts = dict.fromkeys(start for start, _, _ in self.clock_points)
        return {x: fit_clock([(a, b) for start, a, b in self.clock_points if start == x]) for x in starts}

    def report(self) -> dict[str, Any]:
        """Return all counts of the recording and of each session, as keys of capture.json."""
        statistics = self.assembler.link_statistics()
        counts = self.assembler.counts
        clocks = self.fit_clocks()
        return {
            "frames": statistics.frames,
            "lost": counts.lost_frames,
            "crc_errors": statistics.crc_errors,
            "gaps": counts.gaps,
            "reconnects": counts.reconnects,
            "restarts": counts.restarts,
            "overruns": counts.overruns,
            "samples": counts.samples,
            "missing_samples": counts.missing_samples,
            "repeated": counts.repeated_frames,
            "refused": statistics.refused,
            "cut": statistics.truncated,
            "unnamed": counts.frames_without_hello,
            "other_channels": counts.layout_changes,
            "clock_jumps": counts.clock_jumps,
            "raw_bytes": self.position,
            "dropped_bytes": self.dropped_bytes,
            "undecoded_bytes": statistics.longest_undecoded,
            "silent_seconds": self.silence[0] if self.silence else None,
            "highest_queue": self.highest_queue,
            "segments": [self._session_report(s, clocks.get(s.start)) for s in self.assembler.sessions],
            "markers": [asdict(marker) for marker in self.assembler.markers],
            "notes": self._notes(statistics.reasons),
        }

    def _session_report(self, session: LoggerSession, clock: ClockFit | None) -> dict[str, Any]:
        hello = session.hello
        begins = None
        if clock is not None and self.wall_clock_anchor is not None and session.first_time is not None:
            begins = self.wall_clock_anchor[0] + clock.host_time(session.first_time) - self.wall_clock_anchor[1]
        return {
            "file": run_file_name(session) if session.samples else None,
            "why": session.reason,
            "device": hello.device,
            "firmware": hello.firmware,
            "boot": hello.boot,
            "start": session.start,
            "rate": hello.rate,
            "channels": [{"name": c.name, "unit": c.unit} for c in hello.channels],
            "samples": session.samples,
            "gaps": session.gaps,
            "missing_samples": session.missing_samples,
            "first": session.first_time,
            "last": session.last_time,
            "begins": begins,
            "clipped": [name for number, name in self.clipped_channels() if number == session.number],
            "drift": None if clock is None else clock.drift,
            "drift_sd": None if clock is None else clock.drift_sd,
            **({"temperature": None, "battery": None} | session.status),
        }

    def _notes(self, reasons: list[str]) -> list[str]:
        counts = self.assembler.counts
        notes = [f"refused: {reason}" for reason in reasons]
        if counts.frames_without_hello:
            notes.append(f"{counts.frames_without_hello} frames came without the hello that names their channels")
        if counts.repeated_frames:
            notes.append(f"{counts.repeated_frames} repeated frames were ignored")
        if counts.forward_jumps:
            notes.append(
                f"{counts.forward_jumps} times the logger's time advanced by more than a second without a lost frame: "
                "was its clock set? else it missed samples"
            )
        for (number, name), (samples, level) in self.clipped_channels().items():
            notes.append(f"segment {number}: {name} is clipped at {level}, {samples} samples: widen its range")
        for session in self.assembler.sessions:
            if (rate := session.true_rate) is not None:
                stated = f"{session.hello.rate:g}"
                notes.append(
                    f"segment {session.number} has {rate:.5g} samples/s, its hello states {stated}: correct it"
                )
        if self.dropped_bytes:
            notes.append(f"{self.dropped_bytes} bytes were lost while the disk was full")
        return notes + self._link_notes()

    def _link_notes(self) -> list[str]:
        """Return notes on long silence and on bytes without an intact frame."""
        notes = []
        link = self.assembler.link_statistics()
        silent, end = self.silence or NO_SILENCE
        if silent > MAX_SILENCE:
            notes.append(f"no byte came for {silent:.1f} s, from {end - silent:.1f} to {end:.1f} s after the start")
        if self.position and not link.frames:
            notes.append(
                f"{self.position} bytes without a valid frame: check the baud rate, and that the logger sends the "
                "protocol of docs/wire.md"
            )
        elif link.longest_undecoded > MAX_UNDECODED_BYTES:
            notes.append(
                f"{link.longest_undecoded} bytes in a row without a valid frame: the link was unreadable, check the "
                "cable and the logger"
            )
        return notes


def decode(raw: Path, directory: Path) -> Replay:
    """Rebuild the runs of raw bytes, with the journal in the same directory if there is one.

    Raises
    ------
    OSError
        If the disk is full.
    """
    directory.mkdir(parents=True, exist_ok=True)
    replay = Replay(raw, directory)
    replay.add_events(read_journal(raw.with_name(JOURNAL_FILE)))
    size = raw.stat().st_size
    if not replay.advance(size):
        raise OSError(f"{directory}: the disk is full")
    replay.close()
    return replay
