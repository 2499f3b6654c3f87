"""Cases that dask transfers from one worker to another: their arrays arrive as they were sent, aligned."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("distributed")

from distributed import Client

from railui.execution.dask_cluster import DaskRunner
from railui.execution.tasks import ContentHashes, Task, TaskResult
from railui.execution.threads import ThreadRunner
from railui.optimisation.cases import cases_of
from railui.optimisation.evaluation import kernel_rows
from railui.optimisation.search import baseline_values
from railui.optimisation.study_reader import load_study
from tests.execution.cluster import LocalCluster
from tests.execution.small import write_study

MOVES = 3  # in 7 of 8 moves arrays would begin at an address that is no multiple of 8
KEYS = ("flange_margin", "weighted_acceleration")


def move_cases(cluster: LocalCluster, runner: DaskRunner) -> None:
    """Start a second worker and retire the first, which hands over all that it holds."""
    (first,) = runner.accepted_workers()
    cluster.start_worker()
    deadline = time.monotonic() + 60
    while runner.workers < 2:
        assert time.monotonic() < deadline, "no second worker"
        runner.update_workers()
        time.sleep(0.1)
    with Client(cluster.address, set_as_default=False) as client:
        client.retire_workers([first])
        (second,) = client.scheduler_info()["workers"]
        assert second != first and client.has_what()[second], "nothing was handed over"
    runner.update_workers()


def tasks_of(directory: Path) -> list[Task]:
    # names of different lengths, so that arrays behind them would begin at different addresses
    seeds = "[1, 22, 333, 4444]"
    study_file = write_study(directory, length=2000)
    study_file.write_text(study_file.read_text("utf-8").replace("[1, 2]", seeds), "utf-8")
    study = load_study(study_file)
    cases, hashes = cases_of(study), ContentHashes()
    x = baseline_values(study) * np.linspace(0.8, 1.2, 16)[:, None]
    rows = kernel_rows(cases, x)
    return [Task(case, part, KEYS, hashes.hash_rows(case, part, KEYS)) for case, part in zip(cases, rows, strict=True)]


def responses(runner: DaskRunner | ThreadRunner, tasks: list[Task]) -> dict[bytes, tuple[float | str, ...]]:
    found: dict[bytes, tuple[float | str, ...]] = {}

    def deliver(result: TaskResult) -> None:
        columns = [result.responses.values[key].tolist() for key in KEYS]
        found.update(zip(result.task.hashes, zip(*columns, result.responses.reasons, strict=True), strict=True))

    runner.run(tasks, deliver)
    return found


def test_a_case_that_is_transferred_gives_the_digits_of_one_machine(tmp_path: Path, cluster: LocalCluster) -> None:
    tasks = tasks_of(tmp_path)
    expected = responses(ThreadRunner(1), tasks)
    cluster.start_worker()
    runner = DaskRunner(cluster.address)
    try:
        assert responses(runner, tasks) == expected
        for _ in range(MOVES):
            move_cases(cluster, runner)
            assert responses(runner, tasks) == expected
    finally:
        runner.close()
