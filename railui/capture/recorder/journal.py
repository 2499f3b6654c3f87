"""Journal of a recording: one JSON line per event, with the number of raw bytes at that instant."""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

Event = dict[str, Any]
JOURNAL_FILE = "journal.jsonl"
MAX_UNWRITTEN_BYTES = 1 << 20


class Journal:
    """Appending writer of events; a line that the disk refuses is written with the next one."""

    def __init__(self, path: Path) -> None:
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        self._lock = threading.Lock()
        self._unwritten = b""

    def add(self, at: int, event: str, **more: Any) -> Event:
        """Write an event at a position in the raw bytes; return it."""
        line: Event = {"at": at, "event": event, "mono": round(time.monotonic(), 6), **more}
        data = json.dumps(line, ensure_ascii=False).encode() + b"\n"
        with self._lock:
            self._unwritten += data
            try:
                self._unwritten = self._unwritten[os.write(self._fd, self._unwritten) :]
            except OSError:
                self._unwritten = self._unwritten[:MAX_UNWRITTEN_BYTES]
        return line

    def sync(self) -> None:
        """Flush the system's buffers to the disk."""
        os.fsync(self._fd)

    def close(self) -> None:
        """Close the file."""
        os.close(self._fd)


def wall_clock() -> dict[str, Any]:
    """Return the calendar time, the anchor of the monotonic times."""
    now = time.time()
    return {"wall": datetime.fromtimestamp(now, UTC).isoformat(), "wall_s": now}


def read_journal(path: Path) -> Iterator[Event]:
    """Read the events of a journal; skip an unfinished last line (power cut)."""
    if not path.exists():
        return
    with path.open("rb") as file:
        for line in file:
            try:
                event = json.loads(line)
            except ValueError:
                continue
            if isinstance(event, dict) and isinstance(event.get("at"), int) and "event" in event:
                yield event
