"""Errors of the program or the machine end an evaluation and are never stored as failures of designs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.execution.cache import ResultCache
from railui.execution.cached_evaluator import CachedEvaluator
from railui.execution.tasks import ContentHashes, EvaluationError
from railui.execution.threads import ThreadRunner
from railui.optimisation import responses
from railui.optimisation.cases import Case, cases_of
from railui.optimisation.evaluation import ResponseTable, response_table
from railui.optimisation.search import baseline_values
from railui.optimisation.study_reader import load_study
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


@pytest.mark.parametrize("error", [TypeError("broken"), MemoryError(), RuntimeError("the kernel failed")])
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
            raise ValueError("the state matrix is not finite")
        return original(case, rows, *more)

    monkeypatch.setitem(responses.ANALYSES, "ride", checked)
    table = evaluated(cases, x, cache)
    assert np.flatnonzero(table.failed).tolist() == [3]
    assert table.reasons[3, 0] == "ValueError: the state matrix is not finite"


def test_stored_errors_of_the_program_are_computed_again(tmp_path: Path, cases: list[Case], cache: ResultCache) -> None:
    x = designs(tmp_path)
    hashes = ContentHashes().hash_rows(cases[0], cases[0].vehicle.rows(x), KEYS)
    missing = np.array([np.nan]).tobytes()
    reason = "TypeError: The given array is not contiguous or is misaligned."
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
