"""Maps over threads; the kernel releases the global interpreter lock."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import Any, Protocol, TypeVar

from railui.core import resolve_thread_count

A = TypeVar("A")
B = TypeVar("B")
R = TypeVar("R")
T = TypeVar("T")


def map_threads(work: Callable[[T], R], items: Sequence[T], jobs: int | None = None) -> Iterator[R]:
    """Apply a function to items on several threads and yield the results in order.

    Closing the iterator cancels the calls that have not started.

    Parameters
    ----------
    work : callable
    items : sequence
    jobs : int or None
        Number of threads; None for all of the machine.

    Examples
    --------
    >>> list(map_threads(lambda x: x * x, [3, 1, 2], jobs=2))
    [9, 1, 4]
    """
    threads = min(resolve_thread_count(jobs), len(items))
    if threads <= 1:
        yield from map(work, items)
        return
    pool = ThreadPoolExecutor(threads)
    try:
        yield from pool.map(work, items)
    finally:
        pool.shutdown(cancel_futures=True)


class Pool(Protocol):
    """Executor of independent calls: threads of this machine, or processes elsewhere."""

    def map(self, work: Callable[[Any], Any], items: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        """Apply a function to items; yield the number of an item and its result as they arrive."""
        ...


def map_as_completed(work: Callable[[T], R], items: Sequence[T], jobs: int | None = None) -> Iterator[tuple[int, R]]:
    """Apply a function to items on several threads; yield the number of an item and its result as they arrive.

    Closing the iterator cancels the calls that have not started.

    Examples
    --------
    >>> sorted(map_as_completed(lambda x: x * x, [3, 1, 2], jobs=2))
    [(0, 9), (1, 1), (2, 4)]
    """
    threads = min(resolve_thread_count(jobs), len(items))
    if threads <= 1:
        yield from enumerate(map(work, items))
        return
    pool = ThreadPoolExecutor(threads)
    try:
        numbers = {pool.submit(work, item): i for i, item in enumerate(items)}
        for future in as_completed(list(numbers)):
            yield numbers.pop(future), future.result()
    finally:
        pool.shutdown(cancel_futures=True)


def run_both(first: Callable[[], A], second: Callable[[], B], jobs: int | None = None) -> tuple[A, B]:
    """Call two functions, on two threads unless `jobs` is 1, and return both results.

    >>> run_both(lambda: 2 + 2, lambda: "four")
    (4, 'four')
    """
    if resolve_thread_count(jobs) == 1:
        return first(), second()
    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(second)
        return first(), other.result()
