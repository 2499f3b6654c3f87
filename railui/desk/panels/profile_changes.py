"""Changes of numbers that wheel and rail profiles depend on: their contact is computed on a thread first."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from textual.message import Message
from textual.widget import Widget

from railui.desk.services.jobs import LatestJobRunner
from railui.io.problems import FileProblems
from railui.vehicle.design_reader import Design


@dataclass
class ContactComputed(Message):
    """The contact for a requested value is known, so that the form can take the value at once."""

    path: str
    value: Any
    gesture: str


class ProfileChanges:
    """Requested values of a form whose contact is being computed; the newest request of the owner counts."""

    def __init__(self, owner: Widget) -> None:
        self.runner = LatestJobRunner(owner, "contact")
        self.pending: ContactComputed | None = None

    def request(self, design: Design, path: str, value: Any, gesture: str) -> bool:
        """Compute the contact of a design with a value; return False if the value does not change the contact."""
        if design.profiles is None or path not in design.profiles.input_paths():
            return False
        request = ContactComputed(path, value, gesture)
        self.pending = request

        def compute() -> Message:
            with suppress(FileProblems, ValueError):  # shown by the form, which sets the value again
                design.with_values({path: value})  # keeps the contact of these profiles
            return request

        self.runner.submit(compute)
        return True

    def latest(self, path: str) -> Any:
        """Return the value that is requested for a path, or None."""
        return self.pending.value if self.pending is not None and self.pending.path == path else None

    def take(self, event: ContactComputed) -> bool:
        """Return True if a value is still wanted."""
        is_wanted = self.pending is event
        if is_wanted:
            self.pending = None
        return is_wanted

    def cancel(self) -> None:
        """Forget what is requested."""
        self.pending = None
