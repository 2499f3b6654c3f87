"""Work on the threads of this machine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from typing import Final

from railui.core import jobs_or_all
from railui.execution.tasks import PACE, Task, TaskResult, run_task, split_tasks
from railui.optimisation.responses import Responses

SECONDS: Final = 0.25  # of a piece of work: what an interrupt waits for


class ThreadRunner:
    """Threads of this machine, all or so many; the kernel works without Python's lock."""

    def __init__(self, jobs: int | None = None) -> None:
        self._threads = jobs_or_all(jobs)
        self._pace = PACE

    @property
    def workers(self) -> int:
        """The threads."""
        return self._threads

    def run(self, works: Sequence[Task], deliver: Callable[[TaskResult], None]) -> None:
        """Does all the work, piece by piece; after ctrl-c nothing new begins, and what was begun is delivered."""
        pool = ThreadPoolExecutor(self._threads)
        waiting: dict[Future[tuple[Responses, float]], Task] = {}

        def hand_over(future: Future[tuple[Responses, float]]) -> None:
            work, (found, seconds) = waiting.pop(future), future.result()
            self._pace = 0.8 * self._pace + 0.2 * seconds / work.samples
            deliver(TaskResult(work, found, seconds))

        try:
            for piece in split_tasks(works, SECONDS, self._threads, self._pace):
                waiting[pool.submit(run_task, piece.case, piece.rows, piece.keys)] = piece
            for future in as_completed(list(waiting)):
                hand_over(future)
        finally:
            pool.shutdown(cancel_futures=True)
            for future in [future for future in waiting if not future.cancelled() and future.exception() is None]:
                hand_over(future)
