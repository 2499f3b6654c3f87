"""Ordered map over threads; the kernel releases the global interpreter lock."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

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
