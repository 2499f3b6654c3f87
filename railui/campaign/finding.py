"""Findings of the data checks."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """A finding of a data check: check, run, channel, number with unit, and sentence.

    serious: the data are wrong, so that no model fits them. start, end: the affected time [s], if it is a part of the
    run.
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
