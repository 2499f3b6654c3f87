"""Base of results: the data of a command with the design that it is of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from railui.api.display import Summarised
from railui.api.document import json_document

if TYPE_CHECKING:
    from railui.api.design import Design


@dataclass(frozen=True, eq=False)
class DesignResult(Summarised):
    """Result of a design.

    Attributes
    ----------
    design : Design
        Vehicle.
    data : mapping
        The result as `railui.ride`, `railui.stability` and so on return it; SI.
    inputs : tuple of Path
        Files that were read.
    seed : int or None
        Seed of the track; None where it has none.
    """

    COMMAND: ClassVar[str] = ""

    design: Design
    data: Mapping[str, Any] = field(repr=False)
    inputs: tuple[Path, ...] = ()
    seed: int | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on values that are None or uncertain."""
        return tuple(self.data["notes"])

    def summary_notes(self) -> Sequence[str]:
        """Return the notes."""
        return self.notes

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON document that the command of the same name writes: every number finite or None."""
        body = {"design": self.design.name, "overrides": dict(self.design.overrides), **self.data}
        return json_document(self.COMMAND, body, self.inputs, self.seed)


def input_paths(design: Design, file: Path | None = None) -> tuple[Path, ...]:
    """Return the files of a design and of a track."""
    return tuple(path for path in (design.source, file) if path is not None)
