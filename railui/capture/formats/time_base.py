"""Time base of recordings: recognition of the time channel, series of several rates on one clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.capture.processing.recording import Recording
from railui.io.problems import file_problem, suggest_name
from railui.io.table import MAX_ROWS
from railui.io.units import UnitError, convert

TIME_NAMES = ("t", "time", "zeit", "temps", "timestamp", "time_s", "x_time")
DISTANCE_NAMES = ("s", "distance", "position", "km", "chainage", "mileage", "weg")
SAME_TIME_TOLERANCE = 1e-9  # s


@dataclass(frozen=True, eq=False)
class Series:
    """Channel with its own time stamps [s]."""

    name: str
    unit: str | None
    t: FloatArray
    values: FloatArray


def check_size(path: Path, name: str, size: int) -> None:
    """Raise FileProblems if a series claims more values than are supported, before memory is allocated for it."""
    if size > MAX_ROWS:
        message = f"claims {size} values, {MAX_ROWS} are supported"
        raise file_problem(path, message, "export the recording in parts", name)


def merge_series(path: Path, series: list[Series]) -> Recording:
    """Interpolate all series to the time stamps of the fastest, with a note for each.

    Raises
    ------
    FileProblems
        If there are no series.
    """
    if not series:
        raise file_problem(path, "holds no series against time", "export time histories")
    fastest = max(series, key=lambda x: x.t.size)
    channels: dict[str, FloatArray] = {}
    units: dict[str, str | None] = {}
    notes = []
    for item in series:
        name = item.name
        if name in channels:
            name = f"{name}_{sum(n.startswith(name) for n in channels)}"
        values = item.values
        if item.t.shape != fastest.t.shape or np.max(np.abs(item.t - fastest.t)) > SAME_TIME_TOLERANCE:
            values = np.interp(fastest.t, item.t, item.values, left=np.nan, right=np.nan)
            notes.append(f"{name} has its own time stamps: interpolated to those of {fastest.name}")
        channels[name] = values
        units[name] = item.unit
    return Recording(path.name, fastest.t - fastest.t[0], channels, units, sources=(path,), notes=notes)


def recording_from_columns(
    path: Path,
    columns: Mapping[str, FloatArray],
    units: Mapping[str, str | None],
    clock: str | None,
    rate: float | None,
) -> Recording:
    """Build a recording of columns, one of which is the time, or the distance of a recording car.

    Parameters
    ----------
    path
        File of the columns.
    columns, units
        Values [n] and units by name.
    clock
        Name of the time channel; by default it is recognised by its name.
    rate
        Sampling rate [Hz] without a time channel.

    Raises
    ------
    FileProblems
        If there is neither a time or distance channel nor a rate.
    """
    lower = {name.lower(): name for name in columns}
    if clock is not None and clock not in columns:
        raise file_problem(path, f"no channel {clock!r}", suggest_name(clock, columns), "clock")
    clock_name = clock or next((lower[name] for name in TIME_NAMES if name in lower), None)
    abscissa = "t"
    if clock_name is None and rate is None:
        clock_name = next((lower[name] for name in DISTANCE_NAMES if name in lower), None)
        abscissa = "s"
    if clock_name is None and rate is None:
        remedy = f"name it in the map, `clock: NAME`, or give `rate: 200 Hz`; channels are {', '.join(columns)[:300]}"
        raise file_problem(path, "no channel is recognised as the time", remedy, "clock")
    if clock_name is None:
        size = len(next(iter(columns.values())))
        t = np.arange(size) / (rate or 1.0)
    else:
        t = columns[clock_name] * _unit_factor(path, clock_name, units.get(clock_name), "s" if abscissa == "t" else "m")
    return Recording(path.name, t, dict(columns), dict(units), abscissa, sources=(path,))


def _unit_factor(path: Path, name: str, unit: str | None, wanted: str) -> float:
    try:
        return convert(1.0, unit or wanted, wanted)
    except UnitError as error:
        raise file_problem(path, error.message, error.remedy, name) from None
