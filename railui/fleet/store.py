"""Store of a fleet: references and summaries of runs by content hash, in one SQLite file."""

from __future__ import annotations

import hashlib
import io
import json
import os
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.io.sqlite import open_database

DATABASE: Final = "fleet.sqlite"
RESULTS: Final = "railui-fleet"  # directory of the results next to a fleet file
CHECKSUM_BYTES: Final = 16
TABLES: Final = """
CREATE TABLE IF NOT EXISTS results (
  hash TEXT PRIMARY KEY, kind TEXT NOT NULL, subject TEXT NOT NULL, payload BLOB NOT NULL, checksum BLOB NOT NULL)
  WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS files (
  file TEXT PRIMARY KEY, size INTEGER NOT NULL, modified INTEGER NOT NULL, sha256 TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS runs (
  file TEXT PRIMARY KEY, vehicle TEXT NOT NULL, type TEXT NOT NULL, time REAL NOT NULL, mileage REAL, load REAL,
  temperature REAL, section TEXT NOT NULL, hash TEXT NOT NULL, state TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS alarms (
  subject TEXT NOT NULL, quantity TEXT NOT NULL, raised TEXT NOT NULL, document TEXT NOT NULL,
  PRIMARY KEY (subject, quantity, raised)) WITHOUT ROWID;
"""
Arrays = Mapping[str, Any]


class FleetStore:
    """Results by content hash, each with a checksum; a damaged row counts as absent and is computed again.

    Raises OSError if the file cannot be read or written.
    """

    def __init__(self, directory: str | Path, *, readonly: bool = False) -> None:
        self.path = Path(directory) / DATABASE
        with self._as_os_error():
            self.database = open_database(self.path, TABLES, readonly=readonly)

    def close(self) -> None:
        """Close the file."""
        self.database.close()

    def read(self, key: str) -> dict[str, Any] | None:
        """Return the arrays of a result; None where it is not stored, or damaged."""
        with self._as_os_error():
            row = self.database.execute("SELECT payload, checksum FROM results WHERE hash = ?", (key,)).fetchone()
        return None if row is None or row[1] != _checksum(key, row[0]) else unpack(row[0])

    def keys(self, kind: str) -> set[str]:
        """Return the hashes of the stored results of a kind, without damaged ones."""
        query = "SELECT hash, payload, checksum FROM results WHERE kind = ?"
        with self._as_os_error():
            rows = self.database.execute(query, (kind,))
            return {key for key, payload, checksum in rows if checksum == _checksum(key, payload)}

    def write(self, key: str, kind: str, subject: str, arrays: Arrays) -> None:
        """Store a result in one commit."""
        payload = pack(arrays)
        with self._as_os_error(), self.database:
            self.database.execute(
                "INSERT OR REPLACE INTO results VALUES (?, ?, ?, ?, ?)",
                (key, kind, subject, payload, _checksum(key, payload)),
            )

    def file_hash(self, file: Path) -> str:
        """Return the SHA-256 of a file, read again only where its size or its time of change differs."""
        stat = file.stat()
        known = self._known_hash(file, stat)
        if known is not None:
            return known
        digest = hashlib.sha256(file.read_bytes()).hexdigest()
        with self._as_os_error(), self.database:
            values = (str(file), stat.st_size, stat.st_mtime_ns, digest)
            self.database.execute("INSERT OR REPLACE INTO files VALUES (?, ?, ?, ?)", values)
        return digest

    def stored_file_hash(self, file: Path) -> str | None:
        """Return the stored SHA-256 of a file that has not changed since, or cannot be read any more; else None."""
        try:
            stat = file.stat()
        except OSError:
            return self.last_file_hash(file)
        return self._known_hash(file, stat)

    def _known_hash(self, file: Path, stat: os.stat_result) -> str | None:
        query = "SELECT sha256 FROM files WHERE file = ? AND size = ? AND modified = ?"
        with self._as_os_error():
            row = self.database.execute(query, (str(file), stat.st_size, stat.st_mtime_ns)).fetchone()
        return None if row is None else str(row[0])

    def last_file_hash(self, file: Path) -> str | None:
        """Return the SHA-256 that a file had when it was last read; None where it has not been read."""
        with self._as_os_error():
            row = self.database.execute("SELECT sha256 FROM files WHERE file = ?", (str(file),)).fetchone()
        return None if row is None else str(row[0])

    def replace_runs(self, rows: Iterable[tuple[Any, ...]]) -> None:
        """Replace the table of runs: file, vehicle, type, time, mileage, load, temperature, section, hash, state."""
        with self._as_os_error(), self.database:
            self.database.execute("DELETE FROM runs")
            self.database.executemany("INSERT INTO runs VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", rows)

    def runs(self) -> list[tuple[Any, ...]]:
        """Return the table of runs in the order of time, vehicle and file."""
        with self._as_os_error():
            return list(self.database.execute("SELECT * FROM runs ORDER BY time, vehicle, file"))

    def replace_alarms(self, alarms: Iterable[Mapping[str, Any]]) -> None:
        """Replace the table of alarms: vehicle, quantity, day, and the alarm as JSON."""
        rows = [(a["vehicle"], a["quantity"], a["raised"], json.dumps(a, ensure_ascii=False)) for a in alarms]
        with self._as_os_error(), self.database:
            self.database.execute("DELETE FROM alarms")
            self.database.executemany("INSERT OR REPLACE INTO alarms VALUES (?, ?, ?, ?)", rows)

    def alarms(self) -> list[dict[str, Any]]:
        """Return the alarms in the order of the days on which they were raised."""
        with self._as_os_error():
            return [json.loads(row[0]) for row in self.database.execute("SELECT document FROM alarms ORDER BY raised")]

    @contextmanager
    def _as_os_error(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise OSError(f"{self.path}: {error}") from error


def pack(arrays: Arrays) -> bytes:
    """Return arrays as the bytes of an npz file."""
    out = io.BytesIO()
    numbers: dict[str, Any] = {name: np.asarray(value) for name, value in arrays.items()}
    np.savez(out, **numbers)
    return out.getvalue()


def unpack(payload: bytes) -> dict[str, Any]:
    """Return the arrays of `pack`."""
    with np.load(io.BytesIO(payload), allow_pickle=False) as found:
        return {name: found[name] for name in found.files}


def _checksum(key: str, payload: bytes) -> bytes:
    return hashlib.sha256(key.encode() + payload).digest()[:CHECKSUM_BYTES]
