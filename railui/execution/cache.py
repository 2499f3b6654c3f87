"""The store: every evaluation by its content hash, in one SQLite file that a killed process cannot spoil."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.optimisation.responses import Responses

FILE: Final = "results.sqlite"
OURS: Final = (FILE, f"{FILE}-wal", f"{FILE}-shm")
ASKED: Final = 20_000  # hashes in one question
PATIENCE: Final = 10.0  # s for another process that holds the file
REMOTE: Final = ("nfs", "nfs4", "cifs", "smb3", "smbfs", "fuse.sshfs", "9p", "lustre", "ceph", "glusterfs")
TABLES: Final = """
CREATE TABLE IF NOT EXISTS told (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS results (
  hash BLOB PRIMARY KEY, numbers BLOB NOT NULL, travelled REAL NOT NULL, reason TEXT NOT NULL) WITHOUT ROWID;
"""
Known = dict[bytes, tuple[bytes, float, str]]


class Store:
    """Results by hash, and what is told of the search, by name.

    A commit survives the death of the process (write-ahead log); whoever reads meanwhile sees whole commits.
    Raises OSError where the file cannot be read or written.
    """

    def __init__(self, directory: str | Path, *, readonly: bool = False) -> None:
        self.path = Path(directory) / FILE
        with self._guarded():
            if readonly:
                self._db = sqlite3.connect(f"{self.path.resolve().as_uri()}?mode=ro", uri=True, timeout=PATIENCE)
                return
            self._db = sqlite3.connect(self.path, timeout=PATIENCE)
            self._db.execute("PRAGMA journal_mode=WAL")
            self._db.execute("PRAGMA synchronous=NORMAL")
            self._db.executescript(TABLES)

    def close(self) -> None:
        """Closes the file."""
        with self._guarded():
            self._db.close()

    def known(self, hashes: Iterable[bytes]) -> Known:
        """What is known of these hashes: numbers (little-endian doubles), share of the way, reason."""
        asked = list(hashes)
        found: Known = {}
        with self._guarded():
            for i in range(0, len(asked), ASKED):
                some = asked[i : i + ASKED]
                text = f"SELECT * FROM results WHERE hash IN ({','.join('?' * len(some))})"
                found |= {row[0]: row[1:] for row in self._db.execute(text, some)}
        return found

    def put(self, results: Known, told: Mapping[str, Any] | None = None) -> None:
        """Keeps results, and what is told with them, in one commit."""
        rows = [(key, *value) for key, value in results.items()]
        with self._guarded(), self._db:
            self._db.executemany("INSERT OR IGNORE INTO results VALUES (?, ?, ?, ?)", rows)
            self._tell(told or {})

    def tell(self, **told: Any) -> None:
        """Keeps values, as JSON, by name."""
        with self._guarded(), self._db:
            self._tell(told)

    def _tell(self, told: Mapping[str, Any]) -> None:
        rows = [(name, json.dumps(value)) for name, value in told.items()]
        self._db.executemany("INSERT OR REPLACE INTO told VALUES (?, ?)", rows)

    def told(self, name: str) -> Any:
        """A value by name, None where there is none."""
        with self._guarded():
            row = self._db.execute("SELECT value FROM told WHERE name = ?", (name,)).fetchone()
        return None if row is None else json.loads(row[0])

    def __len__(self) -> int:
        with self._guarded():
            return int(self._db.execute("SELECT count(*) FROM results").fetchone()[0])

    @contextmanager
    def _guarded(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise OSError(f"{self.path}: {error}") from error


def packed(found: Responses, hashes: Iterable[bytes], keys: Iterable[str]) -> Known:
    """Answers as the store keeps them: the numbers of the keys in their order."""
    table = np.stack([found.values[key] for key in keys], axis=1).astype("<f8")
    each = zip(hashes, table, found.travelled, found.reasons, strict=True)
    return {key: (row.tobytes(), float(share), reason) for key, row, share, reason in each}


def remote_disk(directory: str | Path) -> str | None:
    """The kind of a disk on another machine, on which a write-ahead log is not safe; None for a local one."""
    try:
        mounts = [line.split()[1:3] for line in Path("/proc/mounts").read_text("utf-8").splitlines()]
    except OSError:
        return None
    path = Path(directory).resolve()
    above = [(len(at), kind) for at, kind in mounts if path.is_relative_to(at)]
    kind = max(above, default=(0, ""))[1]
    return kind if kind in REMOTE else None
