"""Track files: equal spacing, conventions, and a run read as a track."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from railui.io.problems import Problem
from railui.io.table import read_table, write_table
from railui.track.reader import load_track, save_track
from tests.cli.runner import run

ProblemsOf = Callable[[Callable[[], object]], list[Problem]]
S = 0.1 * np.arange(500)
YW = 1e-3 * np.sin(S)


@pytest.mark.parametrize("name", ["line.csv", "line.csv.gz"])
def test_a_saved_track_reads_back(tmp_path: Path, name: str) -> None:
    path = save_track(tmp_path / name, S, YW, phiw=2 * YW, conventions=("one-sided, per rad/m", "seed 1"))
    track = load_track(path)
    np.testing.assert_allclose(track.s, S, rtol=1e-11)
    np.testing.assert_allclose(track.phiw, 2 * YW, rtol=1e-11)
    assert not track.gauge.any()
    assert track.conventions == ("one-sided, per rad/m", "seed 1") and not track.from_run


def test_a_track_in_millimetres_is_read_in_metres(tmp_path: Path) -> None:
    path = write_table(tmp_path / "a.csv", {"s [m]": S, "yw [mm]": 1e3 * YW, "phiw [mrad]": YW})
    np.testing.assert_allclose(load_track(path).yw, YW, rtol=1e-8)
    np.testing.assert_allclose(load_track(path).phiw, 1e-3 * YW, rtol=1e-8)


def problem_positions(problems_of: ProblemsOf, path: Path) -> list[tuple[int, int, str]]:
    return [(p.line, p.column, p.key) for p in problems_of(lambda: load_track(path))]


def test_faults_of_a_track_are_reported_with_their_line(tmp_path: Path, problems_of: ProblemsOf) -> None:
    path = tmp_path / "a.csv"
    bad = S.copy()
    bad[100] += 0.005
    write_table(path, {"s [m]": bad, "yw [m]": YW}, ["two comments", "here"])
    assert problem_positions(problems_of, path) == [(104, 1, "s")]
    hole = YW.copy()
    hole[7] = np.nan
    write_table(path, {"s [m]": S, "yw [m]": hole})
    assert problem_positions(problems_of, path) == [(9, 5, "yw")]
    write_table(path, {"s [m]": S, "y [m]": YW})
    assert problem_positions(problems_of, path) == [(1, 1, "yw")]
    write_table(path, {"s [m]": S, "yw [kg]": YW})
    assert problem_positions(problems_of, path) == [(1, 7, "yw")]


@pytest.mark.parametrize("spacing", [0.02, 2.0, -0.1])
def test_the_spacing_must_be_within_its_limits(tmp_path: Path, spacing: float, problems_of: ProblemsOf) -> None:
    path = save_track(tmp_path / "a.csv", spacing * np.arange(50), np.zeros(50))
    assert problems_of(lambda: load_track(path))[0].key == "s"


def test_a_run_is_also_a_track(tmp_path: Path, columns: Callable[..., dict[str, np.ndarray]]) -> None:
    table = {k: np.delete(v, 600) for k, v in columns(30.0).items() if not k.startswith(("e1", "ay"))}
    track = load_track(write_table(tmp_path / "run.csv", table))
    assert track.from_run and track.s.size == 899  # the longer of its two stretches
    assert np.all(np.diff(track.s) > 0)


def test_a_table_reads_back_what_was_written(tmp_path: Path) -> None:
    rows = {"a [m]": np.array([1.5, np.nan, -3e-9]), "b": np.array([0.0, 2.0, 1e12])}
    path = write_table(tmp_path / "t.csv", rows, ["note"], digits=12)
    read = read_table(path)
    assert (read.names, read.units, read.comments) == (("a", "b"), ("m", None), ("note",))
    np.testing.assert_array_equal(read.rows, np.column_stack(list(rows.values())))
    assert read.cell_position(2, "b") == (5, 8)


@pytest.mark.parametrize(("rows", "value"), [(slice(None), 1e308), (slice(5, 6), 1e308), (slice(5, 6), -1e307)])
def test_numbers_beyond_any_range_are_refused(
    tmp_path: Path, problems_of: ProblemsOf, rows: slice, value: float
) -> None:
    yw = YW.copy()
    yw[rows] = value
    path = save_track(tmp_path / "line.csv", S, yw)
    problems = problems_of(lambda: load_track(path))
    assert [problem.key for problem in problems] == ["yw"]
    result = run("check", str(path))
    assert result.exit_code == 2 and "1 error" in result.stderr and "without a problem" not in result.stderr
