"""Record from which noise is estimated: an unbroken part of a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from railui.arrays import FloatArray
from railui.runs.columns import Form


class Record(Protocol):
    """Measured columns [n] every dt [s], and which of them are responses."""

    @property
    def dt(self) -> float:
        """Interval between samples [s]."""

    @property
    def kind(self) -> Form:
        """Form of the run: bogie, rig, bench or the columns of any other vehicle."""

    @property
    def columns(self) -> Mapping[str, FloatArray]:
        """Columns [n] by name."""

    @property
    def channels(self) -> list[str]:
        """Names of the responses."""

    @property
    def mean_speed(self) -> float:
        """Mean speed [m/s]."""


def band_limits(band: tuple[float, float] | None, dt: float) -> tuple[float, float]:
    """Return the compared band [Hz] at an interval [s]: below 0.45 of the sampling rate, all up to there for None."""
    highest = 0.45 / dt
    return (0.0, highest) if band is None else (band[0], min(band[1], highest))
