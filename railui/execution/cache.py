"""Result cache: every evaluation by its content hash, in one SQLite file with a write-ahead log."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.io.sqlite import open_database
from railui.optimisation.responses import Responses

DATABASE: Final = "results.sqlite"
# the rollback journal is that of a new file, until its write-ahead log is on
DATABASE_FILES: Final = (DATABASE, *(f"{DATABASE}-{x}" for x in ("wal", "shm", "journal")))
MAX_HASHES_PER_QUERY: Final = 20_000
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
CREATE TABLE IF NOT EXISTS told (name TEXT PRIMARY KEY, value TEXT NOT NULL, checksum BLOB) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS results (
  hash BLOB PRIMARY KEY, numbers BLOB NOT NULL, travelled REAL NOT NULL, reason TEXT NOT NULL, checksum BLOB)
  WITHOUT ROWID;
"""
TABLES: Final = ("told", "results")
REMEDY: Final = "name another directory with -o, or move this one away: the search starts anew"
CHECKSUM_BYTES: Final = 16
# of the disk or another process, not of the contents
EXTERNAL_ERRORS: Final = tuple(
    f"SQLITE_{x}" for x in ("BUSY", "LOCKED", "FULL", "READONLY", "CANTOPEN", "IOERR", "PERM")
)
# by hash: values as little-endian doubles, completed share of the track, reason of failure
StoredResults = dict[bytes, tuple[bytes, float, str]]


class ResultCache:
    """Evaluations by content hash, and the state of the search by name, each with a checksum.

    A row that the disk has changed counts as absent, and in `damaged_rows`. A commit survives the end of the process
    by any cause; readers see whole commits only. Raises OSError if the file
    cannot be read or written.
    """

    def __init__(self, directory: str | Path, *, readonly: bool = False) -> None:
        self.path = Path(directory) / DATABASE
        self.damaged_rows = 0
        with self._sqlite_as_os_error():
            self._database = open_database(self.path, TABLE_DEFINITIONS, readonly=readonly)
            if not readonly:
                self._add_checksums()

    def _add_checksums(self) -> None:
        """Add the column of checksums to the tables of an older version; its results are computed again."""
        for table in TABLES:
            if "checksum" not in {row[1] for row in self._database.execute(f"PRAGMA table_info({table})")}:
                self._database.execute(f"ALTER TABLE {table} ADD COLUMN checksum BLOB")
                self._database.execute(f"DELETE FROM {table}")
        self._database.commit()

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
                for key, *value, checksum in self._database.execute(query, part):
                    if checksum == _checksum(key, *value):
                        results[key] = tuple(value)
                    else:
                        self.damaged_rows += 1
        return results

    def put(self, results: StoredResults, state: Mapping[str, Any] | None = None) -> None:
        """Store results and values of the state in one commit."""
        rows = [(key, *value, _checksum(key, *value)) for key, value in results.items()]
        with self._sqlite_as_os_error(), self._database:
            self._database.executemany("INSERT OR REPLACE INTO results VALUES (?, ?, ?, ?, ?)", rows)
            self._replace_values(state or {})

    def set_values(self, **values: Any) -> None:
        """Store values of the state as JSON, by name."""
        with self._sqlite_as_os_error(), self._database:
            self._replace_values(values)

    def _replace_values(self, values: Mapping[str, Any]) -> None:
        texts = {name: json.dumps(value) for name, value in values.items()}
        rows = [(name, text, _checksum(name, text)) for name, text in texts.items()]
        self._database.executemany("INSERT OR REPLACE INTO told VALUES (?, ?, ?)", rows)

    def value(self, name: str) -> Any:
        """Return a value of the state by name, None if it is absent."""
        with self._sqlite_as_os_error():
            row = self._database.execute("SELECT value, checksum FROM told WHERE name = ?", (name,)).fetchone()
        if row is None:
            return None
        if row[1] != _checksum(name, row[0]):
            raise OSError(f"{self.path}: is damaged (checksum of {name!r}): {REMEDY}")
        return json.loads(row[0])

    def __len__(self) -> int:
        with self._sqlite_as_os_error():
            return int(self._database.execute("SELECT count(*) FROM results").fetchone()[0])

    @contextmanager
    def _sqlite_as_os_error(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, UnicodeDecodeError) as error:
            is_external = str(getattr(error, "sqlite_errorname", "")).startswith(EXTERNAL_ERRORS)
            message = str(error) if is_external else f"is damaged ({error}): {REMEDY}"
            raise OSError(f"{self.path}: {message}") from error


def _checksum(*parts: bytes | str | float) -> bytes:
    """Return the checksum of the values of a row."""
    total = hashlib.sha256()
    for part in parts:
        data = part if isinstance(part, bytes) else repr(part).encode("utf-8", "surrogatepass")
        total.update(len(data).to_bytes(8, "little") + data)
    return total.digest()[:CHECKSUM_BYTES]


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
