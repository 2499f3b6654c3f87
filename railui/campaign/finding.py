"""One thing that is found about measured data, with its channel, a number and its place."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One thing about the data: check, run, channel, number with unit, and words; from and to [s] where it has a place.

    `serious`: the data are wrong there, and no model will fit them.
    """

    check: str
    file: str
    channel: str | None
    value: float
    unit: str
    text: str
    serious: bool = False
    start: float | None = None
    end: float | None = None
