"""Time base of recordings: columns on one clock, series of several rates resampled to one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.capture.formats.clocks import (
    DISTANCE_NAMES,
    KILOMETRE_NAMES,
    TIME_NAMES,
    axis_factor,
    check_order,
    check_seconds,
    find_axis,
    is_distance,
    stated_clock,
)
from railui.capture.formats.sentinels import gaps_at_sentinels, without_sentinels
from railui.capture.processing.recording import Recording
from railui.core import Spline
from railui.dsp.integrate import lowpass
from railui.dsp.resample import interpolate_band_limited
from railui.io.problems import file_problem, suggest_name
from railui.io.table import MAX_ROWS
from railui.runs.segments import GAP_INTERVALS, INTERVAL_TOLERANCE

SAME_TIME_TOLERANCE = 1e-9  # s
MAX_IRREGULAR_SHARE = 0.2  # of the steps that differ from their median by half; more are events, not samples
MAX_STATES = 16  # different whole numbers of a channel that is a state, not a signal
FASTER = 0.9  # of the interval, below which a channel is sampled faster and low-passed first
ANTI_ALIAS_CORNER = 0.4  # of the sampling rate


@dataclass(frozen=True, eq=False)
class Series:
    """Channel with its own time stamps [s]; NaN where it has no value.

    `is_discrete`: a state or a counter, whose values are not interpolated.
    """

    name: str
    unit: str | None
    t: FloatArray
    values: FloatArray
    is_discrete: bool = False


def is_discrete(values: np.ndarray) -> bool:
    """Return True for flags, states and counters: whole numbers that are few or hardly ever fall.

    >>> is_discrete(np.array([0, 0, 1, 1])), is_discrete(np.arange(90) % 64), is_discrete(np.arange(9.0))
    (True, True, False)
    """
    if values.dtype.kind == "b":
        return True
    if values.dtype.kind not in "iu" or values.size < 2:
        return False
    falls = np.count_nonzero(values[1:] < values[:-1])
    return bool(falls <= 0.02 * values.size) or np.unique(values).size <= MAX_STATES


def check_size(path: Path, name: str, size: int) -> None:
    """Raise FileProblems if a series claims more values than are supported, before memory is allocated for it."""
    if size > MAX_ROWS:
        message = f"claims {size} values, {MAX_ROWS} are supported"
        raise file_problem(path, message, "export the recording in parts", name)


def merge_series(path: Path, series: Sequence[Series], notes: Sequence[str] = ()) -> Recording:
    """Resample all series to the time stamps of the one with most samples, with a note for each.

    A hole in a series remains one: it is a gap in every channel of the run. Slower channels are interpolated
    band-limited, faster ones low-passed first; a state or a counter keeps its last value.

    Raises
    ------
    FileProblems
        If there are no series, or time stamps are repeated or out of order.
    """
    if not series:
        reason = f": {notes[0]}" if notes else ""
        raise file_problem(path, f"holds no series against time{reason}", "export time histories")
    series, remarks = list(series), list(notes)
    for i, item in enumerate(series):
        check_order(path, item.name, item.t)
        values, marks = without_sentinels(item.name, item.values, item.unit)
        series[i], remarks = replace(item, values=values), remarks + marks
    grid = max(series, key=lambda x: x.t.size)
    channels: dict[str, FloatArray] = {}
    units: dict[str, str | None] = {}
    for item in series:
        name = _free_name(item.name, channels)
        if name != item.name:
            remarks.append(f"{item.name} occurs several times: another one is called {name}")
        if _has_stamps(item, grid.t):
            channels[name] = item.values
        elif _is_irregular(item.t):
            remarks.append(f"{name} has no sampling rate, its time stamps are irregular: left out")
            continue
        else:
            channels[name] = _resampled(item, grid.t)
            how = "its last value is used at those" if item.is_discrete else "resampled band-limited to those"
            remarks.append(f"{name} has its own time stamps, every {_interval(item.t):.6g} s: {how} of {grid.name}")
        units[name] = item.unit
    return Recording(path.name, grid.t, channels, units, sources=(path,), notes=remarks)


def _free_name(name: str, channels: Mapping[str, FloatArray]) -> str:
    number, free = 1, name
    while free in channels:
        free, number = f"{name}_{number}", number + 1
    return free


def _has_stamps(item: Series, t: FloatArray) -> bool:
    return item.t.shape == t.shape and float(np.max(np.abs(item.t - t))) <= SAME_TIME_TOLERANCE


def _interval(t: FloatArray) -> float:
    return float(np.median(np.diff(t))) if t.size > 1 else 0.0


def _is_irregular(t: FloatArray) -> bool:
    steps = np.diff(t)
    return bool(np.mean(np.abs(steps - np.median(steps)) > 0.5 * np.median(steps)) > MAX_IRREGULAR_SHARE)


def _resampled(item: Series, at: FloatArray) -> FloatArray:
    """Return the values of a series at other instants; NaN in its holes and beyond its ends."""
    interval = _interval(item.t)
    valid = np.flatnonzero(np.isfinite(item.values))
    result = np.full(at.shape, np.nan)
    if not valid.size:
        return result
    cuts = np.flatnonzero(np.diff(item.t[valid]) > GAP_INTERVALS * interval) + 1
    slack = INTERVAL_TOLERANCE * interval
    for part in np.split(valid, cuts):
        t, x = item.t[part], item.values[part]
        begin, end = (int(np.searchsorted(at, limit)) for limit in (t[0] - slack, t[-1] + slack))
        rows = slice(begin, end)
        where = np.clip(at[rows], t[0], t[-1])
        if item.is_discrete:
            result[rows] = x[np.searchsorted(t, where, side="right") - 1]
        else:
            result[rows] = _interpolated(t, x, where, _interval(at))
    return result


def _interpolated(t: FloatArray, x: FloatArray, at: FloatArray, wanted: float) -> FloatArray:
    """Interpolate an unbroken part band-limited; uneven time stamps by a cubic spline first."""
    if t.size < 4:
        return np.interp(at, t, x)
    step = float((t[-1] - t[0]) / (t.size - 1))
    even = t[0] + step * np.arange(t.size)
    if float(np.max(np.abs(t - even))) > INTERVAL_TOLERANCE * step:
        x = Spline(t, x)(even)
    if step < FASTER * wanted:
        x = lowpass(x, step, ANTI_ALIAS_CORNER / wanted)
    return interpolate_band_limited(float(t[0]), step, x, at)


def recording_from_columns(
    path: Path,
    columns: Mapping[str, FloatArray],
    units: Mapping[str, str | None],
    clock: str | None,
    rate: float | None,
    lines: Sequence[int] | None = None,
) -> Recording:
    """Build a recording of columns, one of which is the time, or the distance of a recording car.

    Parameters
    ----------
    path
        File of the columns.
    columns, units
        Values [n] and units by name.
    clock
        Name of the time or distance channel; by default it is recognised by its name.
    rate
        Sampling rate [Hz] without a time channel.
    lines
        Line of each row, if the file is a text.

    Raises
    ------
    FileProblems
        If there is neither a time or distance channel nor a rate, or if the time stamps repeat or are out of order.
    """
    clock, units = stated_clock(clock, columns, units)
    if clock is not None and clock not in columns:
        raise file_problem(path, f"no channel {clock!r}", suggest_name(clock, columns), "clock")
    clock_name = clock or find_axis(columns, units, TIME_NAMES, "s")
    abscissa = "s" if clock is not None and is_distance(clock, units.get(clock)) else "t"
    if clock_name is None and rate is None:
        clock_name = find_axis(columns, units, DISTANCE_NAMES, "m")
        abscissa = "s"
    if clock_name is None and rate is None:
        channels = ", ".join(columns)[:300]
        remedy = f"name it, `--clock NAME` or in a map `clock: NAME`, or give `rate: 200 Hz`; channels are {channels}"
        raise file_problem(path, "no channel is recognised as the time or the distance", remedy, "clock")
    columns, notes = gaps_at_sentinels(columns, units, clock_name)
    if clock_name is None:
        size = len(next(iter(columns.values())))
        t = np.arange(size) / (rate or 1.0)
        return Recording(path.name, t, columns, dict(units), sources=(path,), notes=notes)
    if abscissa == "s" and clock_name.lower() in KILOMETRE_NAMES and not units.get(clock_name):
        message, remedy = "has no unit, and would be taken as metres", f"write `{clock_name} [km]` in the header"
        raise file_problem(path, message, remedy, clock_name)
    factor = axis_factor(path, clock_name, units.get(clock_name), "s" if abscissa == "t" else "m")
    valid = np.flatnonzero(np.isfinite(columns[clock_name]))
    if valid.size < columns[clock_name].size:
        count = columns[clock_name].size - valid.size
        notes.append(f"{count} rows without a value of {clock_name} are left out: they are gaps")
        columns = {name: x[valid] for name, x in columns.items()}
        lines = None if lines is None else [lines[i] for i in valid.tolist()]
    if valid.size < 2:
        raise file_problem(path, "has fewer than two values", "record longer", clock_name)
    check_order(path, clock_name, columns[clock_name], lines, may_fall=abscissa == "s")
    t = columns[clock_name] * factor
    if abscissa == "t":
        check_seconds(path, clock_name, t, units.get(clock_name))
    return Recording(path.name, t, dict(columns), dict(units), abscissa, sources=(path,), notes=notes, clock=clock_name)
