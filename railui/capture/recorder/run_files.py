"""Sessions as tables: one file each, whole lines as they arrive; lines that a full disk refuses are written later."""

from __future__ import annotations

import contextlib
import errno
import os
import threading
from pathlib import Path

from railui.capture.recorder.sessions import LoggerSession, Rows

DISK_FULL_ERRORS = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)
WIDE_TYPES = {"i", "I"}  # types with more than seven digits


class RunFiles:
    """Files of the decoded runs in one directory; a session's file is closed once a newer one has rows."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.file_names: list[str] = []
        self._files: dict[int, int] = {}
        self._lock = threading.Lock()  # a file is synced by one thread, and closed by another
        self._pending: list[tuple[int, bytes]] = []

    def add(self, session: LoggerSession, rows: Rows) -> None:
        """Append rows to the file of their session; call `write_pending` until it returns True."""
        data = table_rows(session, rows)
        if session.number not in self._files:
            self.write_pending()
            if self._open(session):
                data = table_header(session) + data
        self._pending.append((session.number, data))

    def write_pending(self) -> bool:
        """Write the pending rows; return False if the disk is full."""
        while self._pending:
            number, data = self._pending[0]
            try:
                written = os.write(self._files[number], data)
            except OSError as error:
                if error.errno in DISK_FULL_ERRORS:
                    return False
                raise
            if written == len(data):
                self._pending.pop(0)
            else:
                self._pending[0] = (number, data[written:])
        self._close_older(1)
        return True

    def sync(self) -> None:
        """Flush the system's buffers of the newest file to the disk."""
        with self._lock:
            if self._files:
                os.fsync(self._files[max(self._files)])

    def close(self) -> None:
        """Close all files."""
        self._close_older(0)

    def _open(self, session: LoggerSession) -> bool:
        """Open the file of a session for appending; return True if it is new."""
        name = run_file_name(session)
        is_new = name not in self.file_names
        flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | (os.O_TRUNC if is_new else 0)
        with self._lock:
            self._files[session.number] = os.open(self.directory / name, flags, 0o644)
        if is_new:
            self.file_names.append(name)
        return is_new

    def _close_older(self, newest: int) -> None:
        """Close all but some newest files: a logger that keeps restarting must not exhaust the open files."""
        for number in sorted(self._files)[: len(self._files) - newest]:
            with self._lock:
                file = self._files.pop(number)
                with contextlib.suppress(OSError):
                    os.fsync(file)
                os.close(file)


def run_file_name(session: LoggerSession) -> str:
    """Return the file name of a session's rows."""
    return f"run_{session.number:03d}.csv"


def table_header(session: LoggerSession) -> bytes:
    """Return the comments and the header of a session's table."""
    hello = session.hello
    lines = [
        "# schema: railui.recording/1",
        f"# logger: {hello.device} {hello.firmware}, start {hello.boot:08x}, {hello.rate:.9g} samples/s",
        f"# segment {session.number}, {session.reason}; t on the logger's clock, 0 at the first sample of its start",
        ",".join(["t [s]", *(f"{c.name} [{c.unit or 1}]" for c in hello.channels)]),
    ]
    return ("\n".join(lines) + "\n").encode()


def table_rows(session: LoggerSession, rows: Rows) -> bytes:
    """Return rows as text, NaN as nan."""
    digits = "".join(",%.10g" if c.type in WIDE_TYPES else ",%.7g" for c in session.hello.channels)
    flat: list[float] = []
    for t, values in zip(rows.t.tolist(), rows.values.tolist(), strict=True):
        flat.append(t)
        flat += values
    return ((f"%.7f{digits}\n" * len(rows.t)) % tuple(flat)).encode()
