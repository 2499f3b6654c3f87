"""Runner of tasks on the threads of this machine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from typing import Final

from railui.core import resolve_thread_count
from railui.execution.tasks import INITIAL_PACE, RESUMES, EvaluationError, Task, TaskResult, run_task, split_tasks
from railui.optimisation.responses import Responses

TASK_SECONDS: Final = 0.25  # duration of a task, for which an interrupt waits
PACE_WEIGHT: Final = 0.2  # of the last task in the moving average of the pace


class ThreadRunner:
    """Runner on all threads of this machine, or on so many; the kernel releases the GIL."""

    def __init__(self, jobs: int | None = None) -> None:
        self._threads = resolve_thread_count(jobs)
        self._pace = INITIAL_PACE

    @property
    def workers(self) -> int:
        """Number of threads."""
        return self._threads

    def run(self, tasks: Sequence[Task], deliver: Callable[[TaskResult], None]) -> None:
        """Run all tasks; after an interrupt or an error start no further one and deliver those already started."""
        pool = ThreadPoolExecutor(self._threads)
        pending: dict[Future[tuple[Responses, float]], Task] = {}

        def deliver_result(future: Future[tuple[Responses, float]]) -> None:
            task = pending.pop(future)
            try:
                responses, seconds = future.result()
            except EvaluationError as error:
                raise EvaluationError(f"{error}: {RESUMES}") from error
            self._pace = (1 - PACE_WEIGHT) * self._pace + PACE_WEIGHT * seconds / task.samples
            deliver(TaskResult(task, responses, seconds))

        try:
            for task in split_tasks(tasks, TASK_SECONDS, self._threads, self._pace):
                pending[pool.submit(run_task, task.case, task.rows, task.keys)] = task
            for future in as_completed(list(pending)):
                deliver_result(future)
        finally:
            pool.shutdown(cancel_futures=True)
            for future in [future for future in pending if not future.cancelled() and future.exception() is None]:
                deliver_result(future)
