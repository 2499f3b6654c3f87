"""Processes of a trial."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager


@contextmanager
def process_pool(processes: int, *, max_tasks_per_child: int | None = None) -> Iterator[ProcessPoolExecutor]:
    """Yield processes; what is queued is given up where the block raises."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, context, max_tasks_per_child=max_tasks_per_child) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
