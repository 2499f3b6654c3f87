"""Comparable parts of a run: inside a track section, at a steady speed, of a bounded duration."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.campaign.segment import Segment
from railui.dsp.intervals import true_intervals
from railui.fleet.schema import TriggersModel

MIN_DURATION: Final = 8.0  # s, some periods of a bogie's hunting motion


@dataclass(frozen=True, eq=False)
class Part:
    """Comparable part of a run: its segment and the section it lies in, "" without sections."""

    segment: Segment
    section: str


def comparable_part(segments: list[Segment], triggers: TriggersModel, section: str = "") -> Part | None:
    """Return the longest part of a run that fulfils the triggers, None where there is none.

    Parameters
    ----------
    section
        The only section that counts, where the metadata of the run name it.

    Notes
    -----
    The part begins where the conditions begin to be fulfilled and has at most `max_duration`, so that runs over a
    section are compared from its start. Among equally long parts the first is taken.
    """
    best: Part | None = None
    for segment in segments:
        for name, mask in _conditions(segment, triggers, section):
            for start, stop in true_intervals(mask):
                stop = min(stop, start + round(triggers.max_duration / segment.dt))
                if (stop - start) * segment.dt < _min_duration(segment, triggers) - 0.5 * segment.dt:
                    continue
                if best is None or stop - start > best.segment.samples:
                    best = Part(_cut(segment, start, stop), name)
    return best


def _min_duration(segment: Segment, triggers: TriggersModel) -> float:
    """Shortest part [s] that is used."""
    if triggers.min_duration is not None:
        return triggers.min_duration
    return 0.0 if segment.is_rig else MIN_DURATION


def _conditions(segment: Segment, triggers: TriggersModel, section: str) -> list[tuple[str, NDArray[np.bool_]]]:
    """Samples that fulfil the triggers, for every section."""
    fulfilled = np.ones(segment.samples, dtype=bool)
    if triggers.speed is not None and not segment.is_rig:
        low, high = triggers.speed
        fulfilled &= (segment.columns["v"] >= low) & (segment.columns["v"] <= high)
    if not triggers.sections or segment.is_rig:
        return [(section, fulfilled)]
    s = segment.columns["s"]
    return [
        (name, fulfilled & (s >= low) & (s <= high))
        for name, (low, high) in triggers.sections.items()
        if section in ("", name)
    ]


def _cut(segment: Segment, start: int, stop: int) -> Segment:
    """Return samples of a segment as one of its own; its track begins with it."""
    if start == 0 and stop == segment.samples:
        return segment
    columns = {name: np.ascontiguousarray(x[start:stop]) for name, x in segment.columns.items()}
    return replace(segment, columns=columns, tables={})
