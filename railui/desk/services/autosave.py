"""Autosave of a session: its parts are written on a thread, and found again after any end of the process."""

from __future__ import annotations

import json
import shutil
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Final

from railui.desk.services.files import log_traceback, state_directory
from railui.execution.lock import LOCK_FILE, Lock, lock_holder
from railui.io.atomic import write_bytes

SCHEMA: Final = "railui.desk-session/1"
MIN_WRITE_INTERVAL: Final = 0.2  # s between two writes
FLUSH_SECONDS: Final = 5.0  # s to wait for the last writes
VERDICT_PARTS: Final = ("verdict", *(f"verdict-{number}" for number in range(2, 9)))  # one for each campaign
PARTS: Final = ("form", "search", "plan", "shelf", *VERDICT_PARTS)
CONTENT_FILES: Final = (*(f"{part}.json" for part in PARTS), *(f"{part}.pickle" for part in VERDICT_PARTS))

Content = dict[str, Any] | bytes


@dataclass(frozen=True)
class EndedSession:
    """Session of a process that has ended, with parts that it did not save."""

    directory: Path

    @property
    def time(self) -> datetime:
        """Time of its last write."""
        files = [self.directory / name for name in CONTENT_FILES]
        return datetime.fromtimestamp(max((f.stat().st_mtime for f in files if f.exists()), default=0.0))

    def read(self, part: str) -> dict[str, Any] | None:
        """Return a part; None if it is absent or cannot be read."""
        try:
            content = json.loads((self.directory / f"{part}.json").read_text("utf-8"))
        except (OSError, ValueError):
            return None
        return content if isinstance(content, dict) and content.get("schema") == SCHEMA else None

    def delete(self) -> None:
        """Delete the session."""
        shutil.rmtree(self.directory, ignore_errors=True)


class Autosave:
    """Parts of the running session, written to its directory by a thread; the newest content of a part counts.

    A state directory that cannot be written is logged once, and nothing is stored.
    """

    def __init__(self) -> None:
        stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
        self.directory = sessions_directory() / f"{stamp}-{time.monotonic_ns() % 10**9:09d}"
        self._lock: Lock | None = None
        self._waiting: dict[str, Callable[[], Content] | None] = {}
        self._changed = threading.Condition()
        self._is_writing = False
        self._thread: threading.Thread | None = None
        self._has_failed = False
        self._is_closed = False

    def put(self, file: str, content: Callable[[], Content]) -> None:
        """Write a file of the session soon; `content` is called on the thread."""
        self._submit(file, content)

    def drop(self, file: str) -> None:
        """Delete a file of the session soon."""
        if self._thread is not None or self.directory.exists():
            self._submit(file, None)

    def adopt(self, session: EndedSession) -> None:
        """Move the files of an ended session to this one; files that this session has stay."""
        self.flush()
        self._create()
        for name in reversed(CONTENT_FILES):  # a description after the file that it describes
            source, target = session.directory / name, self.directory / name
            if source.exists() and not target.exists():
                source.replace(target)
        session.delete()

    def flush(self, seconds: float = FLUSH_SECONDS) -> bool:
        """Wait until everything is written; return False after `seconds`."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._waiting and not self._is_writing, seconds)

    def close(self) -> None:
        """Write the rest, end the thread, and remove the directory if the session has nothing to offer."""
        self.flush()
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
        if self._lock is not None:
            self._lock.release()
            self._lock = None
        if self.directory.exists() and not has_content(self.directory):
            shutil.rmtree(self.directory, ignore_errors=True)

    def _submit(self, file: str, content: Callable[[], Content] | None) -> None:
        with self._changed:
            self._waiting[file] = content
            self._changed.notify_all()
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="autosave", daemon=True)
                self._thread.start()

    def _create(self) -> None:
        if self._lock is None:
            self.directory.mkdir(parents=True, exist_ok=True, mode=0o700)
            self._lock = Lock(self.directory)

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: bool(self._waiting) or self._is_closed)
                if not self._waiting:
                    return
                file = next(iter(self._waiting))
                content = self._waiting.pop(file)
                self._is_writing = True
            self._write_logged(file, content)
            with self._changed:
                self._is_writing = False
                self._changed.notify_all()
            time.sleep(MIN_WRITE_INTERVAL if not self._waiting else 0.0)

    def _write_logged(self, file: str, content: Callable[[], Content] | None) -> None:
        try:
            self._write(file, content)
        except Exception as error:  # autosave must not end the desk
            if not self._has_failed:
                log_traceback(error)
            self._has_failed = True

    def _write(self, file: str, content: Callable[[], Content] | None) -> None:
        path = self.directory / file
        if content is None:
            path.unlink(missing_ok=True)
            return
        made = content()
        if isinstance(made, dict):
            made = json.dumps({"schema": SCHEMA} | made, indent=1).encode("utf-8")
        self._create()
        write_bytes(path, made)


def sessions_directory() -> Path:
    """Return the directory of the autosaved sessions."""
    return state_directory() / "sessions"


def has_content(directory: Path) -> bool:
    """True if a session directory has a part to offer."""
    return any((directory / f"{part}.json").exists() for part in PARTS)


def ended_sessions() -> list[EndedSession]:
    """Return the sessions of processes that have ended, newest first; delete those without content."""
    sessions = []
    with suppress(OSError):
        for directory in sorted(sessions_directory().iterdir(), reverse=True):
            if not directory.is_dir() or _is_running(directory):
                continue
            if has_content(directory):
                sessions.append(EndedSession(directory))
            else:
                shutil.rmtree(directory, ignore_errors=True)
    return sorted(sessions, key=lambda session: session.time, reverse=True)


def _is_running(directory: Path) -> bool:
    """True if a process holds the directory, or one that has not locked it yet might."""
    if not (directory / LOCK_FILE).exists():
        return not has_content(directory) and time.time() - directory.stat().st_mtime < FLUSH_SECONDS
    holder = lock_holder(directory)
    return holder is not None and holder.is_alive


def set_aside(session: EndedSession, part: str) -> Path:
    """Move the files of a part that cannot be restored out of a session; return the directory where they are."""
    target = state_directory() / "unreadable" / session.directory.name
    target.mkdir(parents=True, exist_ok=True, mode=0o700)
    for file in session.directory.glob(f"{part}.*"):
        file.replace(target / file.name)
    return target
