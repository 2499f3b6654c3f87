"""Opening of SQLite files with a write-ahead log."""

from __future__ import annotations

import sqlite3
from pathlib import Path
from typing import Final

BUSY_TIMEOUT: Final = 10.0  # s, for another process that locks the file


def open_database(path: Path, tables: str, *, readonly: bool = False) -> sqlite3.Connection:
    """Open a file and create its tables where they do not exist.

    A commit survives the end of the process by any cause; readers see whole commits only.

    Parameters
    ----------
    path : Path
    tables : str
        Statements that create the tables.
    readonly : bool
        Open an existing file without a change.

    Raises
    ------
    sqlite3.Error
        If the file cannot be opened.
    """
    if readonly:
        return sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True, timeout=BUSY_TIMEOUT)
    database = sqlite3.connect(path, timeout=BUSY_TIMEOUT)
    database.execute("PRAGMA journal_mode=WAL")
    database.execute("PRAGMA synchronous=NORMAL")
    database.executescript(tables)
    return database
