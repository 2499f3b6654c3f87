"""What happened beside the bytes: a line per event, with the number of raw bytes that were there then."""

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
NAME = "journal.jsonl"


class Journal:
    """Appends events; a line that the disk refuses is kept and tried again with the next."""

    def __init__(self, path: Path) -> None:
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        self._lock = threading.Lock()
        self._rest = b""

    def add(self, at: int, event: str, **more: Any) -> Event:
        """Writes an event at a place in the raw bytes; returns it."""
        line: Event = {"at": at, "event": event, "mono": round(time.monotonic(), 6), **more}
        data = json.dumps(line, ensure_ascii=False).encode() + b"\n"
        with self._lock:
            self._rest += data
            try:
                self._rest = self._rest[os.write(self._fd, self._rest) :]
            except OSError:
                self._rest = self._rest[: 1 << 20]
        return line

    def sync(self) -> None:
        """On the disk, not only handed over."""
        os.fsync(self._fd)

    def close(self) -> None:
        """Closes the file."""
        os.close(self._fd)


def wall_clock() -> dict[str, Any]:
    """The one anchor of the monotonic time in the calendar."""
    now = time.time()
    return {"wall": datetime.fromtimestamp(now, UTC).isoformat(), "wall_s": now}


def read_journal(path: Path) -> Iterator[Event]:
    """The events of a journal; a last line that a power cut left unfinished is left out."""
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
