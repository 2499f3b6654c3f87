"""Pools that compute runs: threads of this machine, or the workers of a dask scheduler."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import Any, Final

from railui.core import resolve_thread_count
from railui.fleet.engine import Pool, Work
from railui.progress import SILENT, Progress

CONNECT_TIMEOUT: Final = 10.0  # s, for an answer of the scheduler


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
    """Workers of a dask scheduler with the same environment as this process; see `railui.execution.dask_cluster`.

    A run whose worker dies is computed again by another one. A run that kills several workers is left out.

    Raises
    ------
    TemporaryError
        If the scheduler does not respond, or has no worker with the environment of this process.
    """

    def __init__(self, address: str, progress: Progress = SILENT) -> None:
        from distributed import Client

        from railui.execution.dask_cluster import ClusterError
        from railui.execution.dask_worker import identity_differences, worker_identity

        try:
            self._client = Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False, name="railui")
        except (OSError, ValueError) as error:
            raise ClusterError(
                f"no scheduler answers at {address} ({error}): start one with `dask scheduler`"
            ) from None
        identities = self._client.run(worker_identity, on_error="return")
        self._workers = [worker for worker, identity in identities.items() if not identity_differences(identity)]
        for worker, identity in identities.items():
            if differences := identity_differences(identity):
                progress.message(f"worker {worker} refused: {differences}")
        if not self._workers:
            remedy = f"start some with `dask worker {address} --nthreads 1 --nworkers N`"
            raise ClusterError(f"no worker at {address} that would reproduce the results: {remedy}")

    def map(self, work: Work, items: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        """Apply a function to items; yield the number of an item and its result as they arrive."""
        from distributed import KilledWorker
        from distributed import as_completed as completed

        futures = self._client.map(work, list(items), pure=False, retries=2, workers=self._workers)
        numbers = {future.key: i for i, future in enumerate(futures)}
        for future in completed(futures):
            try:
                result = future.result()
            except KilledWorker:
                result = {"reason": "killed its worker"}
            yield numbers[future.key], result

    def close(self) -> None:
        """Disconnect from the scheduler."""
        self._client.close(timeout=2)


def make_pool(jobs: int | None, cluster: str | None, progress: Progress = SILENT) -> Pool:
    """Return the pool of the options of a command."""
    return ThreadPool(jobs) if cluster is None else DaskPool(cluster, progress)
