"""Progress of long computations: messages, events, and how a watcher stops them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    pass


Watch = Callable[[object], None]


Report = Callable[[str], None]  # is told in lines how far the work is


class Stopped(Exception):
    """Raised by a watcher: the study ends here, and nothing of it is kept."""


def silent(_: str) -> None:
    """Reports nothing."""


def unwatched(_: object) -> None:
    """Watches nothing."""
