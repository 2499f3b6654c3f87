"""Pools that compute runs: threads of this machine, or the workers of a dask scheduler."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from railui.parallel import map_as_completed

if TYPE_CHECKING:
    from railui.execution.dask_cluster import DaskRunner


class ThreadPool:
    """Threads of this machine."""

    def __init__(self, jobs: int | None = None) -> None:
        self._jobs = jobs

    def map(self, work: Callable[[Any], Any], items: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        """Apply a function to items; yield the number of an item and its result as they arrive."""
        return map_as_completed(work, items, self._jobs)


class DaskPool:
    """Workers of a dask scheduler; a run whose worker dies is computed again, one that kills several is left out."""

    def __init__(self, runner: DaskRunner) -> None:
        self._runner = runner

    def map(self, work: Callable[[Any], Any], items: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        """Apply a function to items; yield the number of an item and its result as they arrive."""
        return self._runner.map(work, items, lost={"reason": "killed its worker"})
