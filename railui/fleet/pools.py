"""Pools that compute runs: threads of this machine, or the workers of a dask scheduler."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import TYPE_CHECKING, Any

from railui.core import resolve_thread_count
from railui.fleet.engine import Work

if TYPE_CHECKING:
    from railui.execution.dask_cluster import DaskRunner


class ThreadPool:
    """Threads of this machine; the kernel releases the global interpreter lock."""

    def __init__(self, jobs: int | None = None) -> None:
        self._threads = resolve_thread_count(jobs)

    def map(self, work: Work, items: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        """Apply a function to items; yield the number of an item and its result as they arrive."""
        if self._threads == 1:
            yield from ((i, work(item)) for i, item in enumerate(items))
            return
        pool = ThreadPoolExecutor(self._threads)
        try:
            numbers = {pool.submit(work, item): i for i, item in enumerate(items)}
            for future in as_completed(list(numbers)):
                yield numbers.pop(future), future.result()
        finally:
            pool.shutdown(cancel_futures=True)


class DaskPool:
    """Workers of a dask scheduler; a run whose worker dies is computed again, one that kills several is left out."""

    def __init__(self, runner: DaskRunner) -> None:
        self._runner = runner

    def map(self, work: Work, items: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        """Apply a function to items; yield the number of an item and its result as they arrive."""
        return self._runner.map(work, items, lost={"reason": "killed its worker"})
