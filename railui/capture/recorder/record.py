"""Recorder of a serial port: raw bytes to the disk in one thread, runs decoded from there."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import serial

from railui.capture.recorder.journal import JOURNAL_FILE, Event, Journal, wall_clock
from railui.capture.recorder.link_watch import LinkWatch
from railui.capture.recorder.port import open_port
from railui.capture.recorder.replay import RAW_FILE, Replay
from railui.capture.recorder.run_files import DISK_FULL_ERRORS

DECODE_INTERVAL = 0.25  # s
SYNC_INTERVAL = 1.0  # s
READ_PAUSE = 0.02  # s in which bytes gather: the system buffers 4 kB of a serial line, 44 ms at 921600 baud
READ_TIMEOUT = 0.2  # s
MIN_SILENCE = 1.0  # s without a byte that the journal states
REOPEN_INTERVAL = 0.25  # s between two attempts to open a port that is gone
TICK_INTERVAL = 1.0  # s between two journal entries of the time
MAX_BACKLOG_BYTES = 8 << 20  # in memory while the disk is full


def _ignore_message(text: str) -> None:
    """Ignore a message."""


class Recorder:
    """Recorder of a port into a directory.

    Parameters
    ----------
    port
        Name of the serial port.
    baud
        Baud rate [bit/s].
    directory
        Directory of the recording, created if necessary.
    on_message
        Receiver of messages to the user.

    Raises
    ------
    serial.SerialException
        If the port cannot be opened.
    """

    def __init__(
        self, port: str, baud: int, directory: Path, on_message: Callable[[str], None] = _ignore_message
    ) -> None:
        self.port_name = port
        self.baud = baud
        self.disk_error: OSError | None = None
        self._reported_errors: set[int | None] = set()
        self._on_message = on_message
        self._port: serial.Serial | None = self._open_port()
        directory.mkdir(parents=True, exist_ok=True)
        self._raw = os.open(directory / RAW_FILE, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        self._raw_size = 0
        self._backlog = b""
        self._dropped = 0
        self._journal = Journal(directory / JOURNAL_FILE)
        self._events: list[Event] = []
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._watch = LinkWatch(port, baud)
        self._opened = self._last_byte = time.monotonic()
        self.replay = Replay(directory / RAW_FILE, directory)
        self._add_event("open", port=port, baud=baud, **wall_clock())
        self._threads = [
            threading.Thread(target=target, name=target.__name__, daemon=True)
            for target in (self._listen, self._sync_periodically)
        ]

    def run(self, seconds: float | None = None) -> Iterator[Replay]:
        """Record until `stop`, or for a time [s]; yield the decoded state four times a second."""
        start = time.monotonic()
        for thread in self._threads:
            thread.start()
        try:
            while not self._stop.is_set() and (seconds is None or time.monotonic() - start < seconds):
                remaining = DECODE_INTERVAL if seconds is None else max(start + seconds - time.monotonic(), 0)
                self._stop.wait(min(DECODE_INTERVAL, remaining))
                self._decode()
                yield self.replay
        finally:
            self._finish()

    def stop(self) -> None:
        """End the recording; may be called from any thread or signal handler."""
        self._stop.set()

    def link_fault(self) -> str | None:
        """Return the likely cause where no bytes or no intact frames arrive at present, None otherwise."""
        if self._port is None:  # its loss was reported
            return None
        now = time.monotonic()
        link = self.replay.assembler.link_statistics()
        return self._watch.check(self.replay.position, link, now - max(self._last_byte, self._opened), now)

    def add_marker(self, text: str) -> None:
        """Mark this instant."""
        self._add_event("marker", text=text)

    # -- thread of the link

    def _listen(self) -> None:
        last_tick = 0.0
        while not self._stop.is_set():
            if self._port is None and not self._reopen():
                self._store(b"")
                self._stop.wait(REOPEN_INTERVAL)
                continue
            data = self._read()
            if data:
                self._end_silence()
            self._store(data)
            if data and time.monotonic() - last_tick >= TICK_INTERVAL:
                last_tick = time.monotonic()
                self._add_event("tick")

    def _end_silence(self) -> None:
        """State a silence that ends now in the journal."""
        now = time.monotonic()
        silence, self._last_byte = now - self._last_byte, now
        if silence > MIN_SILENCE:
            self._add_event("silent", seconds=round(silence, 3))

    def _read(self) -> bytes:
        port = self._port
        assert port is not None
        try:
            data = bytes(port.read(1))
            if data:
                self._stop.wait(READ_PAUSE)
                data += bytes(port.read(port.in_waiting))
            return data
        except (serial.SerialException, OSError, TypeError) as error:
            self._add_event("lost", error=str(error)[:200])
            self._on_message(f"{self.port_name} is gone, waiting for it")
            port.close()
            self._port = None
            return b""

    def _reopen(self) -> bool:
        try:
            self._port = self._open_port()
        except (serial.SerialException, OSError, ValueError):
            return False
        self._watch = LinkWatch(self.port_name, self.baud)
        self._opened = time.monotonic()
        self._add_event("reopen")
        self._on_message(f"{self.port_name} is there again: a new segment")
        return True

    def _open_port(self) -> serial.Serial:
        return open_port(self.port_name, self.baud, READ_TIMEOUT)

    def _store(self, data: bytes) -> None:
        """Write bytes to the disk; while it is full or fails, keep up to `MAX_BACKLOG_BYTES` in memory."""
        self._backlog += data
        if len(self._backlog) > MAX_BACKLOG_BYTES:
            self._dropped += len(self._backlog) - MAX_BACKLOG_BYTES
            self._backlog = self._backlog[:MAX_BACKLOG_BYTES]
        while self._backlog:
            try:
                written = os.write(self._raw, self._backlog)
            except OSError as error:
                self._report_disk_error(error)
                return
            with self._lock:
                self._raw_size += written
            self._backlog = self._backlog[written:]
        if self.disk_error is not None:
            self._report_room()

    def _report_disk_error(self, error: OSError) -> None:
        if error.errno not in self._reported_errors:
            self._reported_errors.add(error.errno)
            remedy = "is full ({}): make room" if error.errno in DISK_FULL_ERRORS else "fails ({})"
            limit = f"{MAX_BACKLOG_BYTES >> 20} MB are kept in memory"
            self._on_message(f"the disk {remedy.format(error.strerror)}, {limit}")
        self.disk_error = error

    def _report_room(self) -> None:
        error, self.disk_error = self.disk_error, None
        if error is not None and error.errno in DISK_FULL_ERRORS:
            self._reported_errors.discard(error.errno)
            self._on_message("there is room again, the recording continues")
        if self._dropped:
            self._add_event("dropped", bytes=self._dropped)
            self._dropped = 0

    # -- journal, decoding, synchronisation

    def _add_event(self, event: str, **more: Any) -> None:
        with self._lock:
            self._events.append(self._journal.add(self._raw_size, event, **more))

    def _decode(self) -> None:
        with self._lock:
            events = self._events
            size = self._raw_size
            self._events = []
        self.replay.add_events(events)
        self.replay.highest_queue = max(self.replay.highest_queue, size - self.replay.position)
        self.replay.advance(size)

    def _sync_periodically(self) -> None:
        """Synchronise the files once a second, in a thread of its own because a busy disk may block."""
        while not self._stop.wait(SYNC_INTERVAL):
            self._sync()

    def _sync(self) -> None:
        for sync in (lambda: os.fsync(self._raw), self._journal.sync, self.replay.files.sync):
            try:
                sync()
            except OSError as error:
                self._report_disk_error(error)

    def _finish(self) -> None:
        self._stop.set()
        for thread in self._threads:
            thread.join()
        if self._port is not None:
            self._port.close()
        self._store(b"")
        self._end_silence()
        self._add_event("close")
        self._decode()
        self._sync()
        self.replay.dropped_bytes += len(self._backlog) + self._dropped
        self.replay.close()
        self._journal.close()
        os.close(self._raw)
