"""Lock of a directory for one process at a time, which names the process and its machine."""

from __future__ import annotations

import fcntl
import json
import os
import socket
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Final

from railui.io.problems import TemporaryError

LOCK_FILE: Final = "lock"
MAX_ATTEMPTS: Final = 5  # `lock_holder` of another process locks the file for a moment
ATTEMPT_DELAY: Final = 0.02  # s, times the number of the attempt


class LockedError(TemporaryError):
    """The directory is locked by another process."""


@dataclass(frozen=True)
class Holder:
    """Process named in a lock file: its number, its machine and its start; is_alive as far as this machine knows."""

    pid: int
    host: str
    since: str
    is_alive: bool

    @property
    def is_remote(self) -> bool:
        """True for a process of another machine, whose state is unknown."""
        return self.host != socket.gethostname()

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host}, since {self.since}"


class Lock:
    """Lock of a directory, which the operating system releases at the end of the process, however that ends.

    Parameters
    ----------
    directory : str or Path
    unlock : bool
        Take over the lock of a process of another machine.

    Raises
    ------
    LockedError
        If a living process of this machine, or without `unlock` a process of another machine, holds the lock.
    """

    def __init__(self, directory: str | Path, unlock: bool = False) -> None:
        self.path = Path(directory) / LOCK_FILE
        self._file: IO[str] = self.path.open("a+", encoding="utf-8")
        if not _acquire(self._file):
            holder = lock_holder(directory)
            self._file.close()
            who = holder or "another process"
            raise LockedError(f"{self.path.parent}: in use by {who}: wait until it ends, or stop it")
        previous = _read_holder(self._file, is_alive=False)
        if previous is not None and previous.is_remote and not unlock:
            self._file.close()
            what = f"{self.path.parent}: locked by {previous}, a machine whose processes are not visible from here"
            raise LockedError(f"{what}: if that process has ended, use --unlock")
        since = datetime.now(UTC).isoformat(timespec="seconds")
        self._write(json.dumps({"pid": os.getpid(), "host": socket.gethostname(), "since": since}))

    def _write(self, text: str) -> None:
        self._file.seek(0)
        self._file.truncate()
        self._file.write(text)
        self._file.flush()

    def release(self) -> None:
        """Release the lock and remove the name of the process."""
        self._write("")
        self._file.close()


def lock_holder(directory: str | Path) -> Holder | None:
    """Return the process that holds a directory, or held it when it was killed; None if there is none."""
    try:
        with _open_lock_file(Path(directory) / LOCK_FILE) as file:
            return _read_holder(file, is_alive=not _acquire(file))
    except OSError:
        return None


def _open_lock_file(path: Path) -> IO[str]:
    """Open a lock file for writing, which a lock on a network drive needs, or else for reading."""
    try:
        return path.open("r+", encoding="utf-8")
    except OSError:
        return path.open(encoding="utf-8")


def _acquire(file: IO[str]) -> bool:
    for attempt in range(1, MAX_ATTEMPTS + 1):
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            time.sleep(ATTEMPT_DELAY * attempt)
    return False


def _read_holder(file: IO[str], is_alive: bool) -> Holder | None:
    file.seek(0)
    try:
        content = json.loads(file.read())
        return Holder(int(content["pid"]), str(content["host"]), str(content["since"]), is_alive)
    except (ValueError, KeyError, TypeError):
        return None
