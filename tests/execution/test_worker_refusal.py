"""Workers whose environment turns out to differ when they get a task, on a scheduler in this process."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pytest

pytest.importorskip("distributed")

from railui.execution import dask_cluster
from railui.execution.dask_cluster import BundleRun, ClusterError, DaskRunner
from railui.execution.dask_worker import MismatchedWorker, worker_identity
from railui.execution.task_bundles import TaskBundle
from railui.execution.tasks import environment_identity
from railui.progress import SILENT

MISMATCHED, GOOD, LATE = "tcp://mismatched", "tcp://good", "tcp://late"


class FinishedFuture:
    """Future whose result is known."""

    status = "finished"

    def __init__(self, value: Any) -> None:
        self.value = value

    def add_done_callback(self, callback: Callable[[FinishedFuture], None]) -> None:
        callback(self)

    def result(self, timeout: float) -> Any:
        return self.value

    def cancel(self) -> None:
        """Nothing is left to cancel."""


class Scheduler:
    """Client of a scheduler that prefers the mismatched worker, whose environment looks the same when queried."""

    status = "running"

    def __init__(self, workers: Sequence[str]) -> None:
        self.workers = workers
        self.submissions = 0

    def scheduler_info(self, n_workers: int) -> dict[str, Any]:
        return {"workers": {address: {"nthreads": 1} for address in self.workers}}

    def run(self, function: Callable[[], Any], workers: Sequence[str], on_error: str) -> Mapping[str, Any]:
        assert function is worker_identity
        return dict.fromkeys(workers, environment_identity())

    def submit(self, function: Callable[..., Any], *arguments: Any, workers: Sequence[str] | None, **_: Any) -> Any:
        self.submissions += 1
        assert self.submissions < 100, "the task is submitted again and again"
        chosen = [address for address in self.workers if not workers or address in workers]
        if MISMATCHED in chosen:
            return FinishedFuture(MismatchedWorker(MISMATCHED))
        return FinishedFuture(function(*arguments))


def _runner(
    monkeypatch: pytest.MonkeyPatch,
    workers: Sequence[str],
    remedy: str = "repeat",
    client: type[Scheduler] = Scheduler,
) -> DaskRunner:
    monkeypatch.setattr(dask_cluster, "Client", lambda *_, **__: client(workers))
    monkeypatch.setattr(dask_cluster, "WORKER_TIMEOUT", 0.3)
    return DaskRunner("tcp://scheduler", SILENT, remedy)


def test_a_mapped_function_goes_on_without_a_mismatched_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    runner = _runner(monkeypatch, [MISMATCHED, GOOD])
    assert sorted(runner.map(abs, [-1, -2, -3])) == [(0, 1), (1, 2), (2, 3)]
    assert runner.accepted_workers() == [GOOD]


class ReplacedWorker(Scheduler):
    """Scheduler whose good worker is lost with its task; another one joins."""

    def scheduler_info(self, n_workers: int) -> dict[str, Any]:
        if self.submissions > 1:
            self.workers = [MISMATCHED, LATE]
        return super().scheduler_info(n_workers)

    def submit(self, function: Callable[..., Any], *arguments: Any, workers: Sequence[str] | None, **more: Any) -> Any:
        if workers == [GOOD]:
            self.submissions += 1
            return LostFuture(None)
        return super().submit(function, *arguments, workers=workers, **more)


class LostFuture(FinishedFuture):
    """Future that never finishes."""

    def add_done_callback(self, callback: Callable[[FinishedFuture], None]) -> None:
        """Nothing calls it."""


def test_the_tasks_of_a_lost_worker_go_to_a_new_one(monkeypatch: pytest.MonkeyPatch) -> None:
    runner = _runner(monkeypatch, [MISMATCHED, GOOD], client=ReplacedWorker)
    monkeypatch.setattr(dask_cluster, "POLL_INTERVAL", 0.01)
    assert list(runner.map(abs, [-1])) == [(0, 1)]
    assert runner.accepted_workers() == [LATE]


def test_a_mapped_function_ends_where_all_workers_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    runner = _runner(monkeypatch, [MISMATCHED])
    with pytest.raises(ClusterError, match="1 were refused"):
        list(runner.map(abs, [-1]))


def test_bundles_end_where_all_workers_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    runner = _runner(monkeypatch, [MISMATCHED])
    with pytest.raises(ClusterError, match="1 were refused"):
        BundleRun(runner, lambda _: None).run([TaskBundle([])])


def test_the_remedy_for_a_lost_scheduler_is_that_of_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    runner = _runner(monkeypatch, [GOOD], "start the command again")
    assert str(runner.lost_scheduler()) == "the scheduler at tcp://scheduler is lost: start the command again"
