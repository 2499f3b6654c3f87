"""Errors of the program or the machine end an evaluation and are never stored as failures of designs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.core import Batch, NoResultError, Vehicles
from railui.execution.cache import ResultCache
from railui.execution.cached_evaluator import CachedEvaluator
from railui.execution.session import status
from railui.execution.tasks import ContentHashes, EvaluationError
from railui.execution.threads import ThreadRunner
from railui.optimisation import responses
from railui.optimisation.cases import Case, cases_of
from railui.optimisation.evaluation import ResponseTable, response_table
from railui.optimisation.search import baseline_values
from railui.optimisation.study_reader import load_study
from tests.cli.runner import run as run_cli
from tests.execution.cluster import LocalCluster
from tests.execution.small import run, write_study

KEYS = ("flange_margin",)


@pytest.fixture
def cache(tmp_path: Path) -> Iterator[ResultCache]:
    cache = ResultCache(tmp_path)
    yield cache
    cache.close()


@pytest.fixture
def cases(tmp_path: Path) -> list[Case]:
    return cases_of(load_study(write_study(tmp_path)))[:1]


def designs(tmp_path: Path) -> Any:
    return baseline_values(load_study(tmp_path / "study.yaml")) * np.linspace(0.9, 1.1, 8)[:, None]


def evaluated(cases: list[Case], x: Any, cache: ResultCache) -> ResponseTable:
    return response_table(cases, x, KEYS, CachedEvaluator(ThreadRunner(1), cache))


@pytest.mark.parametrize(
    "error",
    [
        TypeError("broken"),
        MemoryError(),
        RuntimeError("the kernel failed"),
        ValueError("operands could not be broadcast together"),
        KeyError("ayf"),
        ZeroDivisionError("float division by zero"),
        np.linalg.LinAlgError("Last 2 dimensions of the array must be square"),
    ],
)
def test_an_error_of_the_program_ends_the_evaluation_and_is_not_stored(
    error: Exception, tmp_path: Path, cases: list[Case], cache: ResultCache, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: Any) -> Any:
        raise error

    with monkeypatch.context() as patched:
        patched.setitem(responses.ANALYSES, "ride", broken)
        with pytest.raises(EvaluationError, match=rf"{type(error).__name__}.*: all results so far are stored"):
            evaluated(cases, designs(tmp_path), cache)
    assert len(cache) == 0
    assert not evaluated(cases, designs(tmp_path), cache).failed.any()


def test_an_error_of_its_numbers_is_that_of_one_design(
    tmp_path: Path, cases: list[Case], cache: ResultCache, monkeypatch: pytest.MonkeyPatch
) -> None:
    original, x = responses.ANALYSES["ride"], designs(tmp_path)
    faulty = cases[0].vehicle.rows(x)[3]

    def checked(case: Case, rows: Any, *more: Any) -> Any:
        if (rows == faulty).all(axis=1).any():
            raise NoResultError("the flange clearance must be positive: 0 m")
        return original(case, rows, *more)

    monkeypatch.setitem(responses.ANALYSES, "ride", checked)
    table = evaluated(cases, x, cache)
    assert np.flatnonzero(table.failed).tolist() == [3]
    assert table.reasons[3, 0] == "the flange clearance must be positive: 0 m"


def test_a_faulty_call_of_the_kernel_is_no_stiff_design(
    tmp_path: Path, cases: list[Case], cache: ResultCache, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The count of time steps gets one number too few of every vehicle: a mistake of the program."""
    original = Vehicles.required_steps

    def faulty(vehicles: Vehicles, batch: Batch, *more: Any) -> list[int]:
        return original(vehicles, replace(batch, numbers=np.ascontiguousarray(batch.numbers[:, :-1])), *more)

    monkeypatch.setattr(Vehicles, "required_steps", faulty)
    with pytest.raises(EvaluationError, match="ValueError: numbers of a bogie"):
        evaluated(cases, designs(tmp_path), cache)
    assert len(cache) == 0


@pytest.mark.parametrize("number", [0.0, -2900.0, np.nan, np.inf])
def test_numbers_that_the_kernel_refuses_are_those_of_one_design(
    number: float, cases: list[Case], cache: ResultCache
) -> None:
    case = cases[0]
    rows = np.repeat(case.vehicle.model.row[None], 4, axis=0)
    rows[2, case.vehicle.model.columns["vehicle.frame.mass"]] = number
    evaluator = CachedEvaluator(ThreadRunner(1), cache)
    assert np.flatnonzero(evaluator([case], [rows], KEYS).failed).tolist() == [2]
    table = evaluator([case], [rows], ("linear_damping",))
    assert np.flatnonzero(table.failed).tolist() == [2]
    assert table.reasons[2, 0].endswith(("it must be positive", "it must be finite"))


def test_a_mistake_of_the_program_ends_a_search_which_resumes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study, out = write_study(tmp_path, length=200, population=8, generations=2), tmp_path / "out"
    original, calls = responses.ANALYSES["ride"], []

    def broken(*arguments: Any) -> Any:
        calls.append(1)
        if len(calls) > 4:
            raise ValueError("zip() argument 2 is shorter than argument 1")
        return original(*arguments)

    with monkeypatch.context() as patched:
        patched.setitem(responses.ANALYSES, "ride", broken)
        ended = run_cli("optimise", str(study), "-o", str(out), "--jobs", "1")
    assert ended.exit_code == 1 and "ValueError: zip()" in ended.stderr and "the same command resumes" in ended.stderr
    assert status(out)["state"] == "interrupted" and not (out / "result.json").exists()
    resumed = run_cli("optimise", str(study), "-o", str(out), "--jobs", "1")
    assert resumed.exit_code == 0 and status(out)["failed"] == 0


@pytest.mark.parametrize(
    "reason", ["TypeError: The given array is not contiguous or is misaligned.", "ValueError: shapes (3,) and (4,)"]
)
def test_stored_errors_of_the_program_are_computed_again(
    reason: str, tmp_path: Path, cases: list[Case], cache: ResultCache
) -> None:
    x = designs(tmp_path)
    hashes = ContentHashes().hash_rows(cases[0], cases[0].vehicle.rows(x), KEYS)
    missing = np.array([np.nan]).tobytes()
    cache.put(dict.fromkeys(hashes[:4], (missing, 0.0, reason)) | {hashes[4]: (missing, 0.5, "left the track")})
    table = evaluated(cases, x, cache)
    assert np.flatnonzero(table.failed).tolist() == [4]
    assert {row[2] for row in cache.find(hashes).values()} == {"", "left the track"}


BROKEN_PRELOAD = """\
from railui.execution import tasks

def evaluate_case(*arguments):
    raise TypeError("a broken installation")

tasks.evaluate_case = evaluate_case
"""


def test_an_error_of_the_program_on_a_worker_ends_the_search(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    preload = tmp_path / "broken.py"
    preload.write_text(BROKEN_PRELOAD, "utf-8")
    study, out = write_study(tmp_path, length=200, population=8, generations=2), tmp_path / "out"
    cluster = LocalCluster(tmp_path)
    try:
        cluster.start_worker("--preload", str(preload))
        search = run("optimise", study, "-o", out, "--scheduler", cluster.address)
    finally:
        cluster.stop()
    assert search.returncode == 1 and "TypeError: a broken installation" in search.stderr, search.stderr
    assert "twice on tcp://" in search.stderr and "the same command resumes" in search.stderr
    cache = ResultCache(out, readonly=True)
    assert len(cache) == 0
    cache.close()
