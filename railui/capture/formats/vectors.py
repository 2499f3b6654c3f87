"""Vectors of several lengths and rates, each with the time channel that belongs to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.capture.formats.clocks import (
    OWN_CLOCKS,
    TIME_NAMES,
    axis_factor,
    check_seconds,
    find_axis,
    is_time_name,
)
from railui.capture.formats.time_base import Series, merge_series, recording_from_columns
from railui.capture.processing.recording import Recording


@dataclass(frozen=True, eq=False)
class Vectors:
    """Vectors of a file that may differ in length and rate.

    The time of a vector is t_NAME, time_NAME, NAME_t or NAME_time, else the time channel of its length in its group or
    in the file, else its own sampling rate. Vectors without any of these are left out, with a note.

    Attributes
    ----------
    path, columns, units, clock, rate
        As for `recording_from_columns`.
    rates
        Sampling rates [Hz] that the file states for single vectors.
    """

    path: Path
    columns: Mapping[str, FloatArray]
    units: Mapping[str, str | None]
    clock: str | None
    rate: float | None
    rates: Mapping[str, float] = field(default_factory=dict)

    def recording(self) -> Recording:
        """Build a recording of all vectors, on one time base."""
        columns, rates = self.columns, self.rates
        sizes = {x.size for x in columns.values()}
        own_rates = {rates[name] for name in columns if name in rates}
        if len(sizes) < 2 and len(own_rates) < 2 and not any(self._own_clock(name) for name in columns):
            rate = self.rate or next(iter(own_rates), None)
            grouped = None if self.clock or rate else self._shared_clock(next(iter(columns), ""))
            return recording_from_columns(self.path, columns, self.units, self.clock or grouped, rate)
        return merge_series(self.path, *self.series())

    def series(self) -> tuple[list[Series], list[str]]:
        """Return the vectors that have a time, and notes on the others."""
        notes: list[str] = []
        series: list[Series] = []
        longest = max((x.size for x in self.columns.values()), default=0)
        for name, x in self.columns.items():
            if is_time_name(name) or name == self.clock:
                continue
            t = self._time_of(name, self.rates.get(name) or (self.rate if x.size == longest else None))
            if t is None:
                notes.append(f"{name} has {x.size} values and no time of this length: left out")
            else:
                valid = np.isfinite(t)
                series.append(Series(name, self.units.get(name), t[valid], x[valid]))
        return series, notes

    def _own_clock(self, name: str) -> str | None:
        columns = self.columns
        folder, slash, base = name.rpartition("/")
        names = [folder + slash + pattern.format(base) for pattern in OWN_CLOCKS]
        return next((n for n in names if n in columns and columns[n].size == columns[name].size), None)

    def _shared_clock(self, name: str) -> str | None:
        """Return the time channel of the length of a vector, in its group or in the file."""
        columns, units = self.columns, self.units
        same = {n: x for n, x in columns.items() if x.size == columns[name].size} if name in columns else {}
        folder = name.rpartition("/")[0]
        inside = {n: x for n, x in same.items() if n.rpartition("/")[0] == folder}
        for group in (inside, same):
            by_base = {n.rpartition("/")[2]: x for n, x in group.items()}
            found = find_axis(by_base, {n.rpartition("/")[2]: units.get(n) for n in group}, TIME_NAMES, "s")
            if found is not None:
                return next(n for n in group if n.rpartition("/")[2] == found)
        clocks = [n for n in same if is_time_name(n)]
        return clocks[0] if len(clocks) == 1 else None

    def _time_of(self, name: str, rate: float | None) -> FloatArray | None:
        """Return the time stamps [s] of a vector, None if it has none."""
        columns, clock = self.columns, self.clock
        size = columns[name].size
        given = clock if clock is not None and clock in columns and columns[clock].size == size else None
        found = self._own_clock(name) or given or (None if rate else self._shared_clock(name))
        if found is not None:
            t = columns[found] * axis_factor(self.path, found, self.units.get(found), "s")
            check_seconds(self.path, found, t[np.isfinite(t)], self.units.get(found))
            return t
        return None if rate is None else np.arange(size) / rate
