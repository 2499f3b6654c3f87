"""Result cache: a row that the disk has changed is computed again, never used."""

from __future__ import annotations

import random
import sqlite3
from pathlib import Path

import pytest

from railui.execution.cache import DATABASE, ResultCache
from tests.execution.small import result, run, write_study


def test_a_changed_row_counts_as_absent(tmp_path: Path) -> None:
    cache = ResultCache(tmp_path)
    cache.put({b"a": (b"12345678", 1.0, ""), b"b": (b"87654321", 0.5, "derailed")}, {"stand": 3})
    cache.close()
    with sqlite3.connect(tmp_path / DATABASE) as database:
        database.execute("UPDATE results SET travelled = 0.75 WHERE hash = ?", (b"b",))
    cache = ResultCache(tmp_path)
    assert cache.find([b"a", b"b"]) == {b"a": (b"12345678", 1.0, "")} and cache.damaged_rows == 1
    cache.put({b"b": (b"87654321", 0.5, "derailed")})
    assert set(cache.find([b"a", b"b"])) == {b"a", b"b"}
    cache.close()


def test_a_changed_state_is_refused_with_the_remedy(tmp_path: Path) -> None:
    cache = ResultCache(tmp_path)
    cache.set_values(frozen={"study": "a"})
    cache.close()
    with sqlite3.connect(tmp_path / DATABASE) as database:
        database.execute('UPDATE told SET value = \'{"study": "b"}\'')
    with pytest.raises(OSError, match=r"is damaged .*: name another directory with -o"):
        ResultCache(tmp_path, readonly=True).value("frozen")


def test_a_store_of_an_older_version_is_computed_anew(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / DATABASE) as database:
        database.execute("CREATE TABLE told (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID")
        columns = "hash BLOB PRIMARY KEY, numbers BLOB NOT NULL, travelled REAL NOT NULL, reason TEXT NOT NULL"
        database.execute(f"CREATE TABLE results ({columns}) WITHOUT ROWID")
        database.execute("INSERT INTO results VALUES (?, ?, 1.0, '')", (b"a", b"12345678"))
    cache = ResultCache(tmp_path)
    assert cache.find([b"a"]) == {} and len(cache) == 0
    cache.close()


def test_flipped_bits_in_a_store_are_refused_or_change_nothing(tmp_path: Path) -> None:
    study = write_study(tmp_path, length=200, population=8, generations=3)
    out = tmp_path / "out"
    assert run("optimise", study, "-o", out).returncode == 0
    expected, whole = result(out), (out / DATABASE).read_bytes()
    for name in (f"{DATABASE}-wal", f"{DATABASE}-shm"):
        (out / name).unlink(missing_ok=True)
    rng = random.Random(4)
    for _ in range(4):
        data = bytearray(whole)
        for _ in range(20):
            data[rng.randrange(100, len(data))] ^= 1 << rng.randrange(8)
        (out / DATABASE).write_bytes(data)
        done = run("optimise", study, "-o", out)
        assert "Traceback" not in done.stderr
        if done.returncode == 0:
            assert result(out) == expected
        else:
            assert "damaged" in done.stderr or "locked" in done.stderr, done.stderr
        for name in (f"{DATABASE}-wal", f"{DATABASE}-shm"):
            (out / name).unlink(missing_ok=True)


def test_fewer_generations_than_before_give_a_warning(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run("optimise", write_study(tmp_path, length=200, population=8, generations=3), "-o", out).returncode == 0
    done = run("optimise", write_study(tmp_path, length=200, population=8, generations=2), "-o", out)
    assert done.returncode == 0 and "2 generations replace the result of 3" in done.stderr
