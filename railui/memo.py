"""Bounded cache of computed values."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Generic, TypeVar

Value = TypeVar("Value")


class IdentityCache(Generic[Value]):
    """Cache of at most `max_size` values that discards the least recently used one.

    A key is compared by equality. An `owner`, an object that need not be hashable such as a `Model`, is compared by
    identity; the cache keeps it alive, so that no later object can take over its identity. Threads may share a cache:
    two that ask for the same absent value at once both compute it. A pickled copy starts empty.

    Parameters
    ----------
    max_size : int
        Largest number of values.

    Examples
    --------
    >>> cache = IdentityCache[float](max_size=2)
    >>> model = {"mass": 2.0}
    >>> cache.get(3, lambda: 3 * model["mass"], owner=model)
    6.0
    >>> cache.get(3, lambda: -1.0, owner=model), cache.get(3, lambda: -1.0, owner={"mass": 2.0})
    (6.0, -1.0)
    """

    def __init__(self, max_size: int) -> None:
        self.max_size = max_size
        self._entries: OrderedDict[Hashable, tuple[object, Value]] = OrderedDict()
        self._lock = Lock()

    def __len__(self) -> int:
        return len(self._entries)

    def __reduce__(self) -> tuple[type[IdentityCache[Value]], tuple[int]]:
        return type(self), (self.max_size,)

    def get(self, key: Hashable, compute: Callable[[], Value], owner: object = None) -> Value:
        """Return the value of a key (and of an owner); compute it if it is absent."""
        full_key = (id(owner), key)
        with self._lock:
            entry = self._entries.get(full_key)
            if entry is not None:
                self._entries.move_to_end(full_key)
                return entry[1]
        value = compute()
        with self._lock:
            self._entries[full_key] = (owner, value)
            self._entries.move_to_end(full_key)
            while len(self._entries) > self.max_size:
                self._entries.popitem(last=False)
        return value
