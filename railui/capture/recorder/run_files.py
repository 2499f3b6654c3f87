"""Segments as tables: one file each, whole lines as they come, and what a full disk refuses kept for later."""

from __future__ import annotations

import contextlib
import errno
import os
import threading
from pathlib import Path

from railui.capture.recorder.segments import Rows, Segment

FULL = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)
FINE = {"i", "I"}  # types with more digits than seven


class RunFiles:
    """The decoded runs of a recording in one directory; a segment's file is closed once a newer one has rows."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.names: list[str] = []
        self._files: dict[int, int] = {}
        self._lock = threading.Lock()  # a file is synced by one thread, and closed by another
        self._rest: list[tuple[int, bytes]] = []

    def add(self, segment: Segment, rows: Rows) -> None:
        """Appends rows to the file of their segment; call `push` until it says that all is written."""
        data = table_rows(segment, rows)
        name = run_name(segment)
        if segment.number not in self._files:
            self.push()
            begun = name in self.names
            flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | (0 if begun else os.O_TRUNC)
            with self._lock:
                self._files[segment.number] = os.open(self.directory / name, flags, 0o644)
            if not begun:
                self.names.append(name)
                data = head(segment) + data
        self._rest.append((segment.number, data))

    def push(self) -> bool:
        """Writes what waits; False where the disk is full."""
        while self._rest:
            number, data = self._rest[0]
            try:
                written = os.write(self._files[number], data)
            except OSError as error:
                if error.errno in FULL:
                    return False
                raise
            if written == len(data):
                self._rest.pop(0)
            else:
                self._rest[0] = (number, data[written:])
        self._close_all_but(1)
        return True

    def sync(self) -> None:
        """The newest file on the disk, not only handed over."""
        with self._lock:
            if self._files:
                os.fsync(self._files[max(self._files)])

    def close(self) -> None:
        """Closes all files."""
        self._close_all_but(0)

    def _close_all_but(self, newest: int) -> None:
        """A logger that restarts again and again must not use up the files that a process may have open."""
        for number in sorted(self._files)[: len(self._files) - newest]:
            with self._lock:
                file = self._files.pop(number)
                with contextlib.suppress(OSError):
                    os.fsync(file)
                os.close(file)


def run_name(segment: Segment) -> str:
    """The file of a segment's rows."""
    return f"run_{segment.number:03d}.csv"


def head(segment: Segment) -> bytes:
    """Comments and header of a segment's table."""
    hello = segment.hello
    lines = [
        "# schema: railui.recording/1",
        f"# logger: {hello.device} {hello.firmware}, start {hello.boot:08x}, {hello.rate:.9g} samples/s",
        f"# segment {segment.number}, {segment.why}; t on the logger's clock, 0 at the first sample of its start",
        ",".join(["t [s]", *(f"{c.name} [{c.unit or 1}]" for c in hello.channels)]),
    ]
    return ("\n".join(lines) + "\n").encode()


def table_rows(segment: Segment, rows: Rows) -> bytes:
    """Rows as text, NaN as nan."""
    digits = "".join(",%.10g" if c.type in FINE else ",%.7g" for c in segment.hello.channels)
    flat: list[float] = []
    for t, values in zip(rows.t.tolist(), rows.values.tolist(), strict=True):
        flat.append(t)
        flat += values
    return ((f"%.7f{digits}\n" * len(rows.t)) % tuple(flat)).encode()
