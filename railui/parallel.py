"""Work that stands alone, side by side on threads: the kernel computes without the interpreter's lock."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from railui.core import jobs_or_all

A = TypeVar("A")
B = TypeVar("B")
R = TypeVar("R")
T = TypeVar("T")


def map_threads(work: Callable[[T], R], items: Sequence[T], jobs: int | None = None) -> Iterator[R]:
    """What work makes of every item, in their order, on so many threads (None: all that the machine has).

    Whoever stops taking results does not wait for those that have not begun.

    >>> list(beside(lambda x: x * x, [3, 1, 2], jobs=2))
    [9, 1, 4]
    """
    threads = min(jobs_or_all(jobs), len(items))
    if threads <= 1:
        yield from map(work, items)
        return
    pool = ThreadPoolExecutor(threads)
    try:
        yield from pool.map(work, items)
    finally:
        pool.shutdown(cancel_futures=True)


def run_both(first: Callable[[], A], second: Callable[[], B], jobs: int | None = None) -> tuple[A, B]:
    """What two pieces of work make, beside each other where there is more than one thread; one's error is raised.

    >>> both(lambda: 2 + 2, lambda: "four")
    (4, 'four')
    """
    if jobs_or_all(jobs) == 1:
        return first(), second()
    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(second)
        return first(), other.result()
