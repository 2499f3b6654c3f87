"""Progress of long computations: messages and events to whoever started them."""

from __future__ import annotations


class Stopped(Exception):
    """Stop requested by the receiver of progress: the computation ends and its result is discarded."""


class Progress:
    """Receiver of progress that ignores everything; subclasses override what they need.

    A receiver stops the computation by raising `Stopped` in either method.
    """

    def message(self, text: str) -> None:
        """Receive a line for the user."""

    def event(self, event: object) -> None:
        """Receive an intermediate result, for example a `FitIteration`."""


SILENT = Progress()
