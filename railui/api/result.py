"""Base of results: the data of a command with the design that it is of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

from railui.api.display import Summarised
from railui.api.document import json_document

if TYPE_CHECKING:
    from railui.api.design import Design
    from railui.ride_quality.evaluation import TrackLike
    from railui.track.excitation import TrackSource

DEFAULT_RADIUS: Final = 600.0  # m, of results of a curve


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
    context : mapping
        Keys of the document that say what was computed, before those of `data`.
    """

    COMMAND: ClassVar[str] = ""

    design: Design
    data: Mapping[str, Any] = field(repr=False)
    inputs: tuple[Path, ...] = ()
    seed: int | None = None
    context: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on values that are None or uncertain."""
        return tuple(self.data["notes"])

    def summary_notes(self) -> Sequence[str]:
        """Return the notes."""
        return self.notes

    def body(self) -> dict[str, Any]:
        """Return the contents of the document: design and overrides, the context, the data."""
        return {"design": self.design.name, "overrides": dict(self.design.overrides), **self.context, **self.data}

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON document that the command of the same name writes: every number finite or None."""
        return json_document(self.COMMAND, self.body(), self.inputs, self.seed)


def input_paths(design: Design, file: Path | None = None) -> tuple[Path, ...]:
    """Return the files of a design and of a track."""
    return tuple(path for path in (design.source, file) if path is not None)


def sources_of(track: TrackLike | None, seeds: Sequence[int] | None) -> list[TrackSource | None]:
    """Return a track for each seed, [None] without a track; ValueError for seeds without a track."""
    from railui.track.excitation import resolve_track

    if track is None:
        if seeds is not None:
            raise ValueError("seeds need a track")
        return [None]
    return [resolve_track(track, seed) for seed in ([None] if seeds is None else seeds)]


def source_files(design: Design, source: TrackSource | None) -> tuple[Path, ...]:
    """Return the files of a design and of a track that is read."""
    return input_paths(design, None if source is None else source.file)


def metres_per_second(speed: float | str | None) -> float | None:
    """Return a speed [m/s] of a number or a quantity."""
    from railui.io.units import read_speed

    return read_speed(speed) if isinstance(speed, str) else speed
