"""Which series is the time, and series of several rates brought to one clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.capture.processing.recording import Recording
from railui.io.problems import nearest, one_problem
from railui.io.table import MOST_ROWS
from railui.io.units import UnitError, convert

TIMES = ("t", "time", "zeit", "temps", "timestamp", "time_s", "x_time")
PLACES = ("s", "distance", "position", "km", "chainage", "mileage", "weg")


@dataclass(frozen=True, eq=False)
class Series:
    """One channel with stamps of its own [s]."""

    name: str
    unit: str | None
    t: FloatArray
    values: FloatArray


def check_size(path: Path, name: str, size: int) -> None:
    """FileProblems where a series claims more values than are read, before there is memory for them."""
    if size > MOST_ROWS:
        what = f"claims {size} values, {MOST_ROWS} are the most"
        raise one_problem(path, what, "export the recording in parts", name)


def one_clock(path: Path, series: list[Series]) -> Recording:
    """All series at the stamps of the fastest; slower ones are interpolated, which is told. FileProblems for none."""
    if not series:
        raise one_problem(path, "holds no series against time", "export time histories")
    best = max(series, key=lambda x: x.t.size)
    channels: dict[str, FloatArray] = {}
    units: dict[str, str | None] = {}
    notes = []
    for one in series:
        name = one.name if one.name not in channels else f"{one.name}_{sum(n.startswith(one.name) for n in channels)}"
        values = one.values
        if one.t.shape != best.t.shape or np.max(np.abs(one.t - best.t)) > 1e-9:
            values = np.interp(best.t, one.t, one.values, left=np.nan, right=np.nan)
            notes.append(f"{name} has stamps of its own: laid on those of {best.name}")
        channels[name], units[name] = values, one.unit
    return Recording(path.name, best.t - best.t[0], channels, units, sources=(path,), notes=notes)


def of_columns(
    path: Path,
    columns: Mapping[str, FloatArray],
    units: Mapping[str, str | None],
    clock: str | None,
    rate: float | None,
) -> Recording:
    """Columns with one among them that is the time [s], or the place [m]; else a `rate` [Hz]. FileProblems without."""
    lower = {name.lower(): name for name in columns}
    if clock is not None and clock not in columns:
        raise one_problem(path, f"no channel {clock!r}", nearest(clock, columns), "clock")
    named = clock or next((lower[name] for name in TIMES if name in lower), None)
    against = "t"
    if named is None and rate is None:
        named = next((lower[name] for name in PLACES if name in lower), None)
        against = "s"
    if named is None and rate is None:
        remedy = f"name it in the map, `clock: NAME`, or give `rate: 200 Hz`; channels are {', '.join(columns)[:300]}"
        raise one_problem(path, "no channel is the time", remedy, "clock")
    if named is None:
        size = len(next(iter(columns.values())))
        t = np.arange(size) / (rate or 1.0)
    else:
        t = columns[named] * _factor(path, named, units.get(named), "s" if against == "t" else "m")
    return Recording(path.name, t, dict(columns), dict(units), against, sources=(path,))


def _factor(path: Path, name: str, unit: str | None, wanted: str) -> float:
    try:
        return convert(1.0, unit or wanted, wanted)
    except UnitError as error:
        raise one_problem(path, error.message, error.remedy, name) from None
