"""Time channels of recordings: recognition by name, units, order of the time stamps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.io.problems import NO_POSITION, Position, file_problem
from railui.io.units import UnitError, convert

TIME_NAMES = ("t", "time", "zeit", "temps", "timestamp", "time_s", "x_time")
DISTANCE_NAMES = (
    *("s", "distance", "dist", "position", "location", "km", "chainage", "mileage", "weg", "strecke", "station"),
    *("stationierung", "kilometer", "kilometre", "kilometrierung", "pk", "point kilométrique", "afstand"),
)
# a column of one of these names without a unit is hardly in metres
KILOMETRE_NAMES = ("km", "kilometer", "kilometre", "kilometrierung", "pk", "point kilométrique")
OWN_CLOCKS = ("t_{}", "time_{}", "{}_t", "{}_time")  # time channel of one channel
MAX_UNSTATED_INTERVAL = 1.0  # s of a time without a unit: rows that are rarer are of milliseconds or less
MAX_UNIX_TIME = 1e11  # s since 1970, in the year 5138: larger numbers are milliseconds or less
TIME_UNITS = {
    **dict.fromkeys(("sec", "secs", "second", "seconds", "sek"), "s"),
    **dict.fromkeys(("msec", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("usec", "microsecond", "microseconds"), "us"),
    **dict.fromkeys(("nsec", "nanosecond", "nanoseconds"), "ns"),
    **dict.fromkeys(("mins", "minute", "minutes"), "min"),
    **dict.fromkeys(("hour", "hours"), "h"),
}  # fmt: skip


def axis_factor(path: Path, name: str, unit: str | None, wanted: str) -> float:
    """Return the factor of a time or distance axis to s or m; raise FileProblems for another unit."""
    label = (unit or "").strip()
    try:
        return convert(1.0, TIME_UNITS.get(label.lower(), label) or wanted, wanted)
    except UnitError as error:
        raise file_problem(path, error.message, error.remedy, name) from None


def find_axis(
    columns: Mapping[str, FloatArray], units: Mapping[str, str | None], names: Sequence[str], wanted: str
) -> str | None:
    """Return the channel with one of some names, in their order, and with a unit of the axis or none.

    >>> x = np.arange(4.0)
    >>> find_axis({"T": x, "Time": x}, {"T": "K", "Time": "ms"}, TIME_NAMES, "s")
    'Time'
    """
    for wanted_name in names:
        same = [name for name in columns if name.lower() == wanted_name]
        for name in sorted(same, key=lambda n: n != wanted_name):
            try:
                axis_factor(Path(), name, units.get(name), wanted)
            except ValueError:
                continue
            return name
    return None


def is_distance(name: str, unit: str | None) -> bool:
    """Return True for the named axis of a recording that is a distance: by its unit, without one by its name.

    >>> is_distance("Lauf", "km"), is_distance("Strecke", None), is_distance("s", None), is_distance("Zeit", "ms")
    (True, True, False, False)
    """
    if unit:
        try:
            axis_factor(Path(), name, unit, "m")
        except ValueError:
            return False
        return True
    return name.lower() in DISTANCE_NAMES and name.lower() != "s"


def is_time_name(name: str) -> bool:
    """Return True for the name of a time channel, of a whole file, a group or one channel.

    >>> is_time_name("rack/time"), is_time_name("t_rf"), is_time_name("rate")
    (True, True, False)
    """
    base = name.rpartition("/")[2].lower()
    return base in TIME_NAMES or base.startswith(("t_", "time_")) or base.endswith(("_t", "_time"))


def stated_clock(
    clock: str | None, columns: Mapping[str, FloatArray], units: Mapping[str, str | None]
) -> tuple[str | None, Mapping[str, str | None]]:
    """Separate the name of a clock from a unit that is given with it, which replaces that of the file.

    >>> stated_clock("t [ms]", {"t": np.arange(4.0)}, {"t": None})
    ('t', {'t': 'ms'})
    """
    if clock is None or clock in columns or not clock.endswith("]"):
        return clock, units
    name, _, unit = clock[:-1].rpartition("[")
    return (name.strip(), {**units, name.strip(): unit}) if name.strip() in columns else (clock, units)


def check_seconds(path: Path, name: str, t: FloatArray, unit: str | None) -> None:
    """Raise FileProblems for times [s] that are hardly in seconds: rare rows without a unit, or beyond any calendar."""
    remedy = f"write `{name} [ms]`, or its actual unit, in the header, or give it by `clock: {name} [ms]` in the map"
    interval = float(np.median(np.abs(np.diff(t)))) if t.size > 1 else 0.0
    if t.size and float(np.max(np.abs(t))) > MAX_UNIX_TIME:
        raise file_problem(path, f"is up to {np.max(np.abs(t)):.3g} s, beyond any time since 1970", remedy, name)
    if not unit and interval > MAX_UNSTATED_INTERVAL:
        raise file_problem(path, f"has no unit, in seconds there would be a row every {interval:g} s", remedy, name)


def check_order(
    path: Path, name: str, t: FloatArray, lines: Sequence[int] | None = None, *, may_fall: bool = False
) -> None:
    """Raise FileProblems with the first row whose time stamp repeats the one before it, or precedes it.

    Parameters
    ----------
    path, name
        File and name of the time channel.
    t
        Time stamps without NaN [n].
    lines
        Line of each row in the file, if it is a text.
    may_fall
        True for a distance, which falls where the car runs against the mileage.
    """
    steps = np.diff(t)
    if may_fall and steps.size and np.median(steps) < 0:
        steps = -steps
    faults = np.flatnonzero(~(steps > 0))
    if not faults.size:
        return
    k = int(faults[0])
    position: Position = (lines[k + 1], 1) if lines is not None else NO_POSITION
    place = "" if lines is not None else f"row {k + 2}: "
    more = f" (and {faults.size - 1} more rows)" if faults.size > 1 else ""
    if steps[k] == 0:
        message = f"{place}{t[k + 1]:.16g} a second time{more}"
        remedy = "leave the repeated row out, export the time with more digits, or name another channel as `clock`"
    else:
        message = f"{place}{t[k + 1]:.16g} after {t[k]:.16g}: rows are out of order{more}"
        remedy = "sort the rows, or cut the recording where its clock was set back"
    raise file_problem(path, message, remedy, name, position=position)
