"""Result cache: every evaluation by its content hash, in one SQLite file with a write-ahead log."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.optimisation.responses import Responses

DATABASE: Final = "results.sqlite"
DATABASE_FILES: Final = (DATABASE, f"{DATABASE}-wal", f"{DATABASE}-shm")
MAX_HASHES_PER_QUERY: Final = 20_000
BUSY_TIMEOUT: Final = 10.0  # s, for another process that locks the file
NETWORK_FILE_SYSTEMS: Final = (
    "nfs",
    "nfs4",
    "cifs",
    "smb3",
    "smbfs",
    "fuse.sshfs",
    "9p",
    "lustre",
    "ceph",
    "glusterfs",
)
# the table `told` holds the state of the search; its name is part of the file format
TABLE_DEFINITIONS: Final = """
CREATE TABLE IF NOT EXISTS told (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS results (
  hash BLOB PRIMARY KEY, numbers BLOB NOT NULL, travelled REAL NOT NULL, reason TEXT NOT NULL) WITHOUT ROWID;
"""
# by hash: values as little-endian doubles, completed share of the track, reason of failure
StoredResults = dict[bytes, tuple[bytes, float, str]]


class ResultCache:
    """Evaluations by content hash, and the state of the search by name.

    A commit survives the end of the process by any cause; readers see whole commits only. Raises OSError if the file
    cannot be read or written.
    """

    def __init__(self, directory: str | Path, *, readonly: bool = False) -> None:
        self.path = Path(directory) / DATABASE
        with self._sqlite_as_os_error():
            if readonly:
                uri = f"{self.path.resolve().as_uri()}?mode=ro"
                self._database = sqlite3.connect(uri, uri=True, timeout=BUSY_TIMEOUT)
                return
            self._database = sqlite3.connect(self.path, timeout=BUSY_TIMEOUT)
            self._database.execute("PRAGMA journal_mode=WAL")
            self._database.execute("PRAGMA synchronous=NORMAL")
            self._database.executescript(TABLE_DEFINITIONS)

    def close(self) -> None:
        """Close the file."""
        with self._sqlite_as_os_error():
            self._database.close()

    def find(self, hashes: Iterable[bytes]) -> StoredResults:
        """Return the stored results among these hashes."""
        wanted = list(hashes)
        results: StoredResults = {}
        with self._sqlite_as_os_error():
            for i in range(0, len(wanted), MAX_HASHES_PER_QUERY):
                part = wanted[i : i + MAX_HASHES_PER_QUERY]
                query = f"SELECT * FROM results WHERE hash IN ({','.join('?' * len(part))})"
                results |= {row[0]: row[1:] for row in self._database.execute(query, part)}
        return results

    def put(self, results: StoredResults, state: Mapping[str, Any] | None = None) -> None:
        """Store results and values of the state in one commit."""
        rows = [(key, *value) for key, value in results.items()]
        with self._sqlite_as_os_error(), self._database:
            self._database.executemany("INSERT OR IGNORE INTO results VALUES (?, ?, ?, ?)", rows)
            self._replace_values(state or {})

    def set_values(self, **values: Any) -> None:
        """Store values of the state as JSON, by name."""
        with self._sqlite_as_os_error(), self._database:
            self._replace_values(values)

    def _replace_values(self, values: Mapping[str, Any]) -> None:
        rows = [(name, json.dumps(value)) for name, value in values.items()]
        self._database.executemany("INSERT OR REPLACE INTO told VALUES (?, ?)", rows)

    def value(self, name: str) -> Any:
        """Return a value of the state by name, None if it is absent."""
        with self._sqlite_as_os_error():
            row = self._database.execute("SELECT value FROM told WHERE name = ?", (name,)).fetchone()
        return None if row is None else json.loads(row[0])

    def __len__(self) -> int:
        with self._sqlite_as_os_error():
            return int(self._database.execute("SELECT count(*) FROM results").fetchone()[0])

    @contextmanager
    def _sqlite_as_os_error(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise OSError(f"{self.path}: {error}") from error


def pack_responses(responses: Responses, hashes: Iterable[bytes], keys: Iterable[str]) -> StoredResults:
    """Return responses in the format of the cache, the values in the order of the keys."""
    table = np.stack([responses.values[key] for key in keys], axis=1).astype("<f8")
    rows = zip(hashes, table, responses.distance_share, responses.reasons, strict=True)
    return {key: (values.tobytes(), float(share), reason) for key, values, share, reason in rows}


def network_file_system(directory: str | Path) -> str | None:
    """Return the kind of the network file system that holds a directory, None for a local disk.

    A write-ahead log is not safe on a network file system.
    """
    try:
        mounts = [line.split()[1:3] for line in Path("/proc/mounts").read_text("utf-8").splitlines()]
    except OSError:
        return None
    path = Path(directory).resolve()
    parents = [(len(mount_point), kind) for mount_point, kind in mounts if path.is_relative_to(mount_point)]
    kind = max(parents, default=(0, ""))[1]
    return kind if kind in NETWORK_FILE_SYSTEMS else None
