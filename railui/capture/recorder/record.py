"""The recording: a thread that puts raw bytes on the disk, and beside it the runs that are read from there."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import serial

from railui.capture.recorder.journal import NAME as JOURNAL
from railui.capture.recorder.journal import Event, Journal, wall_clock
from railui.capture.recorder.replay import RAW, Replay
from railui.capture.recorder.run_files import FULL

FLUSH, SYNC = 0.25, 1.0  # s
PAUSE = 0.02  # s in which bytes gather: the system keeps 4 kB for a serial line, 44 ms at 921600 baud
RETRY = 0.25  # s between two attempts to open a port that is gone
MOST_BACKLOG = 8 << 20  # bytes kept while the disk is full
TICK = 1.0  # s between two notes of the time


class Recorder:
    """Records a port into a directory. Raises serial.SerialException where the port cannot be opened."""

    def __init__(self, port: str, baud: int, directory: Path, tell: Callable[[str], None] = lambda _: None) -> None:
        self.name, self.baud, self.tell = port, baud, tell
        self._port: serial.Serial | None = self._opened()
        directory.mkdir(parents=True, exist_ok=True)
        self._raw = os.open(directory / RAW, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        self.size = 0
        self.full: OSError | None = None
        self._backlog = b""
        self._dropped = 0
        self._journal = Journal(directory / JOURNAL)
        self._events: list[Event] = []
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self.replay = Replay(directory / RAW, directory)
        self._note("open", port=port, baud=baud, **wall_clock())
        self._threads = [
            threading.Thread(target=work, name=work.__name__, daemon=True) for work in (self._listen, self._keep_safe)
        ]

    def run(self, seconds: float | None = None) -> Iterator[Replay]:
        """Records until `stop`, or for so many seconds; yields four times a second for whoever watches."""
        begun = time.monotonic()
        for thread in self._threads:
            thread.start()
        try:
            while not self._stop.is_set() and (seconds is None or time.monotonic() - begun < seconds):
                self._stop.wait(FLUSH if seconds is None else min(FLUSH, max(begun + seconds - time.monotonic(), 0)))
                self._decode()
                yield self.replay
        finally:
            self._finish()

    def stop(self) -> None:
        """Ends the recording cleanly; from any thread or signal."""
        self._stop.set()

    def marker(self, text: str) -> None:
        """Marks this instant."""
        self._note("marker", text=text)

    # -- the thread of the link

    def _listen(self) -> None:
        ticked = 0.0
        while not self._stop.is_set():
            if self._port is None and not self._reopen():
                self._store(b"")
                self._stop.wait(RETRY)
                continue
            data = self._read()
            self._store(data)
            if data and time.monotonic() - ticked >= TICK:
                ticked = time.monotonic()
                self._note("tick")

    def _read(self) -> bytes:
        port = self._port
        assert port is not None
        try:
            data = bytes(port.read(1))
            if data:
                self._stop.wait(PAUSE)
                data += bytes(port.read(port.in_waiting))
            return data
        except (serial.SerialException, OSError, TypeError) as error:
            self._note("lost", error=str(error)[:200])
            self.tell(f"{self.name} is gone, waiting for it")
            port.close()
            self._port = None
            return b""

    def _reopen(self) -> bool:
        try:
            self._port = self._opened()
        except (serial.SerialException, OSError, ValueError):
            return False
        self._note("reopen")
        self.tell(f"{self.name} is there again: a new segment")
        return True

    def _opened(self) -> serial.Serial:
        return serial.Serial(self.name, self.baud, timeout=0.2, exclusive=True)

    def _store(self, data: bytes) -> None:
        """Bytes to the disk; while it is full they are kept, as many as memory is meant for."""
        self._backlog += data
        if len(self._backlog) > MOST_BACKLOG:
            self._dropped += len(self._backlog) - MOST_BACKLOG
            self._backlog = self._backlog[:MOST_BACKLOG]
        while self._backlog:
            try:
                written = os.write(self._raw, self._backlog)
            except OSError as error:
                if error.errno not in FULL:
                    self.tell(f"the disk fails: {error}")
                self._tell_full(error)
                return
            with self._lock:
                self.size += written
            self._backlog = self._backlog[written:]
        if self.full is not None:
            self.full = None
            self.tell("there is room again, recording goes on")
            if self._dropped:
                self._note("dropped", bytes=self._dropped)
                self._dropped = 0

    def _tell_full(self, error: OSError) -> None:
        if self.full is None:
            self.tell(f"the disk is full ({error.strerror}): make room, {MOST_BACKLOG >> 20} MB are kept in memory")
        self.full = error

    # -- beside it

    def _note(self, event: str, **more: Any) -> None:
        with self._lock:
            self._events.append(self._journal.add(self.size, event, **more))

    def _decode(self) -> None:
        with self._lock:
            events, self._events, size = self._events, [], self.size
        self.replay.tell(events)
        self.replay.highest_queue = max(self.replay.highest_queue, size - self.replay.at)
        self.replay.step(size)

    def _keep_safe(self) -> None:
        """Once a second on the disk for good: a thread of its own, because a busy disk takes its time."""
        while not self._stop.wait(SYNC):
            self._sync()

    def _sync(self) -> None:
        for sync in (lambda: os.fsync(self._raw), self._journal.sync, self.replay.files.sync):
            try:
                sync()
            except OSError as error:
                self._tell_full(error)

    def _finish(self) -> None:
        self._stop.set()
        for thread in self._threads:
            thread.join()
        if self._port is not None:
            self._port.close()
        self._store(b"")
        self._note("close")
        self._decode()
        self._sync()
        self.replay.dropped += len(self._backlog) + self._dropped
        self.replay.close()
        self._journal.close()
        os.close(self._raw)
