"""Raw bytes and journal to runs: the one way, for what is being recorded and for what was."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from railui.capture.recorder.assembly import Assembly
from railui.capture.recorder.clock import ClockFit, fit_clock
from railui.capture.recorder.journal import NAME as JOURNAL
from railui.capture.recorder.journal import Event, read_journal
from railui.capture.recorder.run_files import RunFiles, run_name
from railui.capture.recorder.segments import Rows, Segment

RAW = "raw.bin"
PIECE = 1 << 16
Point = tuple[int, float, float]


class Replay:
    """Reads raw bytes from the disk as far as they go, with the events between them, and writes the runs."""

    def __init__(self, raw: Path, directory: Path) -> None:
        self.assembly = Assembly()
        self.files = RunFiles(directory)
        self.at = 0
        self.highest_queue = 0
        self.points: list[Point] = []  # boot, time of the newest sample, time here [s]
        self.anchor: tuple[float, float] | None = None  # wall clock and time here
        self.dropped = 0
        self.watch: Callable[[Segment, Rows], None] = lambda segment, rows: None  # gets the rows as they come
        self._events: deque[Event] = deque()
        self._raw = raw.open("rb")

    def tell(self, events: Iterable[Event]) -> None:
        """Events that happened, in their order."""
        self._events += events

    def step(self, size: int) -> bool:
        """Goes on to so many raw bytes; False where the disk is full and the runs must wait."""
        while self.files.push():
            while self._events and self._events[0]["at"] <= self.at:
                self._apply(self._events.popleft())
            until = min([size, self.at + PIECE] + [e["at"] for e in list(self._events)[:1]])
            if until <= self.at:
                return True
            data = self._raw.read(until - self.at)
            if not data:
                return True
            self.at += len(data)
            for segment, rows in self.assembly.feed(data):
                self.files.add(segment, rows)
                self.watch(segment, rows)
        return False

    def close(self) -> None:
        """The end: what waits is written, or the disk is full for good."""
        self.assembly.close()
        self.files.push()
        self.files.close()
        self._raw.close()

    def _apply(self, event: Event) -> None:
        kind = event["event"]
        newest = self.assembly.newest
        if newest is not None and "mono" in event and kind in ("tick", "close"):
            self.points.append((*newest, float(event["mono"])))
        if kind == "reopen":
            self.assembly.reconnect()
        elif kind == "marker":
            self.assembly.marker(str(event.get("text", "")))
        elif kind == "dropped":
            self.dropped += int(event.get("bytes", 0))
        elif kind == "open" and "wall_s" in event:
            self.anchor = float(event["wall_s"]), float(event["mono"])

    # -- what is told of it

    def clocks(self) -> dict[int, ClockFit | None]:
        """The logger's clock against this machine's, per start of the logger."""
        boots = dict.fromkeys(boot for boot, _, _ in self.points)
        return {boot: fit_clock([(a, b) for other, a, b in self.points if other == boot]) for boot in boots}

    def report(self) -> dict[str, Any]:
        """Everything that was counted, per recording and per segment."""
        heard, counts = self.assembly.total(), self.assembly.counts
        clocks = self.clocks()
        return {
            "frames": heard.frames,
            "lost": counts.lost,
            "crc_errors": heard.crc_errors,
            "gaps": counts.gaps,
            "reconnects": counts.reconnects,
            "restarts": counts.restarts,
            "overruns": counts.overruns,
            "samples": counts.samples,
            "missing_samples": counts.missing,
            "repeated": counts.repeated,
            "refused": heard.refused,
            "cut": heard.cut,
            "unnamed": counts.unnamed,
            "other_channels": counts.relayouts,
            "clock_jumps": counts.clock_jumps,
            "raw_bytes": self.at,
            "dropped_bytes": self.dropped,
            "highest_queue": self.highest_queue,
            "segments": [self._segment(s, clocks.get(s.hello.boot)) for s in self.assembly.segments],
            "markers": [asdict(marker) for marker in self.assembly.markers],
            "notes": self._notes(heard.reasons),
        }

    def _segment(self, segment: Segment, clock: ClockFit | None) -> dict[str, Any]:
        hello = segment.hello
        begins = None
        if clock is not None and self.anchor is not None and segment.first is not None:
            begins = self.anchor[0] + clock.here(segment.first) - self.anchor[1]
        return {
            "file": run_name(segment) if segment.samples else None,
            "why": segment.why,
            "device": hello.device,
            "firmware": hello.firmware,
            "boot": hello.boot,
            "rate": hello.rate,
            "channels": [{"name": c.name, "unit": c.unit} for c in hello.channels],
            "samples": segment.samples,
            "gaps": segment.gaps,
            "missing_samples": segment.missing,
            "first": segment.first,
            "last": segment.last,
            "begins": begins,
            "drift": None if clock is None else clock.drift,
            "drift_sd": None if clock is None else clock.drift_sd,
            **({"temperature": None, "battery": None} | segment.status),
        }

    def _notes(self, reasons: list[str]) -> list[str]:
        counts = self.assembly.counts
        notes = [f"refused: {reason}" for reason in reasons]
        if counts.unnamed:
            notes.append(f"{counts.unnamed} frames came without the hello that names their channels")
        if counts.repeated:
            notes.append(f"{counts.repeated} frames came a second time and were left out")
        if self.dropped:
            notes.append(f"{self.dropped} bytes were lost while the disk was full")
        if self.at and not self.assembly.total().frames:
            notes.append(f"{self.at} bytes and no frame: is the baud rate right, and is it a logger of docs/wire.md?")
        return notes


def decode(raw: Path, directory: Path) -> Replay:
    """Rebuilds the runs of raw bytes, with the journal that lies beside them where there is one."""
    directory.mkdir(parents=True, exist_ok=True)
    replay = Replay(raw, directory)
    replay.tell(read_journal(raw.with_name(JOURNAL)))
    size = raw.stat().st_size
    if not replay.step(size):
        raise OSError(f"{directory}: the disk is full")
    replay.close()
    return replay
