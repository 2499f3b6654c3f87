"""History of states with undo and redo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

State = TypeVar("State")


@dataclass(frozen=True)
class Revision(Generic[State]):
    """State with a description of the change that led to it; one slider movement has one `gesture`."""

    state: State
    description: str
    gesture: str = ""


class History(Generic[State]):
    """Revisions of a state with undo and redo.

    >>> history = History(1)
    >>> history.push(2, "two")
    >>> history.undo(), history.current, history.redo(), history.current
    ('two', 1, 'two', 2)
    """

    def __init__(self, state: State) -> None:
        self.revisions = [Revision(state, "as opened")]
        self.index = 0

    @property
    def current(self) -> State:
        """Current state."""
        return self.revisions[self.index].state

    def descriptions(self) -> tuple[str, ...]:
        """Return what led to the current state, the same description once in a row."""
        texts = [revision.description for revision in self.revisions[: self.index + 1]]
        return tuple(text for i, text in enumerate(texts) if not i or text != texts[i - 1])

    def push(self, state: State, description: str, gesture: str = "") -> None:
        """Add a state; replace the last one if it has the same gesture. States that were undone are discarded."""
        last = self.revisions[self.index]
        position = self.index if gesture and last.gesture == gesture and self.index else self.index + 1
        self.revisions[position:] = [Revision(state, description, gesture)]
        self.index = position

    def replace(self, state: State) -> None:
        """Replace the current state, without a step to undo."""
        last = self.revisions[self.index]
        self.revisions[self.index] = Revision(state, last.description, last.gesture)

    def undo(self) -> str | None:
        """Return to the previous state; return the description of what was undone, or None."""
        if not self.index:
            return None
        self.index -= 1
        return self.revisions[self.index + 1].description

    def redo(self) -> str | None:
        """Return to the next state; return its description, or None."""
        if self.index + 1 >= len(self.revisions):
            return None
        self.index += 1
        return self.revisions[self.index].description
