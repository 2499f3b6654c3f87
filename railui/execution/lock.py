"""The lock of a directory: one process at a time, named by its number and its machine."""

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

from railui.io.problems import LaterError

FILE: Final = "lock"


class LockedError(LaterError):
    """Another process works in the directory."""


@dataclass(frozen=True)
class Holder:
    """Who holds a lock: the process, its machine, since when; living where the system says so."""

    pid: int
    host: str
    since: str
    living: bool

    @property
    def elsewhere(self) -> bool:
        """Is it a process of another machine, of which nothing can be said from here?"""
        return self.host != socket.gethostname()

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host}, since {self.since}"


class Lock:
    """Holds a directory. The system lets go of it with the process, however that ends.

    Raises LockedError where another process of this machine lives in it, or one of another machine left its name
    and `unlock` is not said.
    """

    def __init__(self, directory: str | Path, unlock: bool = False) -> None:
        self.path = Path(directory) / FILE
        self._file: IO[str] = self.path.open("a+", encoding="utf-8")
        if not _taken(self._file):
            who = holder(directory)
            self._file.close()
            raise LockedError(f"{self.path.parent}: {who or 'another process'} works here: wait for it, or stop it")
        left = _read(self._file, living=False)
        if left is not None and left.elsewhere and not unlock:
            self._file.close()
            what = f"{self.path.parent}: locked by {left}, a machine that cannot be asked from here"
            raise LockedError(f"{what}: where that process has ended, say --unlock")
        self.left = left
        since = datetime.now(UTC).isoformat(timespec="seconds")
        self._write({"pid": os.getpid(), "host": socket.gethostname(), "since": since})

    def _write(self, told: dict[str, object]) -> None:
        self._file.seek(0)
        self._file.truncate()
        self._file.write(json.dumps(told) if told else "")
        self._file.flush()

    def release(self) -> None:
        """Lets go; nobody's name is left."""
        self._write({})
        self._file.close()


def holder(directory: str | Path) -> Holder | None:
    """Who holds a directory, or held it when it was killed; None where nobody does."""
    try:
        with (Path(directory) / FILE).open("r+", encoding="utf-8") as file:
            return _read(file, living=not _taken(file))
    except OSError:
        return None


def _taken(file: IO[str], tries: int = 5) -> bool:
    for i in range(tries):  # whoever only looks holds it for a moment
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            time.sleep(0.02 * (i + 1))
    return False


def _read(file: IO[str], living: bool) -> Holder | None:
    file.seek(0)
    try:
        told = json.loads(file.read())
        return Holder(int(told["pid"]), str(told["host"]), str(told["since"]), living)
    except (ValueError, KeyError, TypeError):
        return None
