"""Date-times and clock times of recordings, in seconds to the microsecond."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date

import numpy as np

from railui.arrays import FloatArray

CLOCK = r"(?P<hour>\d{1,2}):(?P<minute>\d\d):(?P<second>\d\d)(?:[.,](?P<fraction>\d{1,9}))?"
ZONE = r"\s*(?P<zone>Z|UTC|[+-]\d\d:?\d\d)?"
DATES = (
    r"(?P<year>\d{4})[-/.](?P<month>\d\d)[-/.](?P<day>\d\d)",
    r"(?P<day>\d{1,2})\.(?P<month>\d{1,2})\.(?P<year>\d{4})",
    r"(?P<slashed>\d{1,2}/\d{1,2}/\d{4})",
)
PATTERNS = (*(re.compile(rf"{day}[T ,]\s*{CLOCK}{ZONE}") for day in DATES), re.compile(CLOCK))
EPOCH = date(1970, 1, 1).toordinal()
DAY = 86_400  # s
NANOSECONDS = 1_000_000_000
MIN_STEP_OVER_MIDNIGHT = DAY // 2  # s by which a clock time must fall


class StampError(ValueError):
    """Unreadable time stamps: index of the first, message and remedy."""

    def __init__(self, index: int, message: str, remedy: str) -> None:
        super().__init__(f"{message}, {remedy}")
        self.index, self.message, self.remedy = index, message, remedy


def is_time_stamp(cell: str) -> bool:
    """Return True for a date with a time, or a time of the day with seconds.

    >>> is_time_stamp("2026-11-22T23:59:50.005Z"), is_time_stamp("23:59:50"), is_time_stamp("12.5")
    (True, True, False)
    """
    return any(pattern.fullmatch(cell) for pattern in PATTERNS)


def parse_time_stamps(cells: Sequence[str], missing: frozenset[str]) -> FloatArray:
    """Convert time stamps to seconds [n]: since 1970 (UTC without a zone), or of the day; NaN for missing ones.

    Times of the day run on over midnight.

    Raises
    ------
    StampError
        If a cell is no time stamp, if the stamps have several forms, or if the order of day and month is open.

    Examples
    --------
    >>> parse_time_stamps(["1970-01-02 00:00:00.25", "1970-01-02T01:00:00,5+01:00"], frozenset()).tolist()
    Traceback (most recent call last):
    ...
    railui.capture.formats.time_stamps.StampError: only some of the time stamps have a zone, write it in all of them
    >>> parse_time_stamps(["23:59:59.5", "00:00:00.000001"], frozenset()).tolist()
    [86399.5, 86400.000001]
    """
    form: tuple[object, ...] | None = None
    first_slashed: str | None = None
    nanoseconds: list[int | None] = []
    for i, cell in enumerate(cells):
        if cell.lower() in missing:
            nanoseconds.append(None)
            continue
        parts = next((m.groupdict() for p in PATTERNS if (m := p.fullmatch(cell))), None)
        if parts is None:
            raise StampError(i, f"{cell[:40]!r} is no time stamp", "correct the cell, or empty it")
        slashed = parts.get("slashed")
        first_slashed = first_slashed or slashed
        if slashed != first_slashed:
            message = f"the order of day and month in {slashed} is open"
            raise StampError(i, message, "write the dates as 2026-11-22")
        here = ("year" in parts, bool(slashed), parts.get("zone") is not None)
        form = form or here
        if here != form:
            raise StampError(i, "only some of the time stamps have a zone", "write it in all of them")
        nanoseconds.append(_nanoseconds(parts, i, cell))
    seconds = np.array([np.nan if n is None else n / NANOSECONDS for n in nanoseconds], dtype=np.float64)
    return seconds if form is None or form[0] or form[1] else _over_midnight(seconds)


def _nanoseconds(parts: dict[str, str | None], index: int, cell: str) -> int:
    hour, minute, second = (int(parts[name] or 0) for name in ("hour", "minute", "second"))
    days = 0
    try:
        if hour > 23 or minute > 59 or second > 60:
            raise ValueError("hour, minute or second")
        if parts.get("year"):
            days = date(*(int(parts[name] or 0) for name in ("year", "month", "day"))).toordinal() - EPOCH
    except ValueError:
        raise StampError(index, f"{cell[:40]!r} is no time of a calendar", "correct the cell, or empty it") from None
    total = days * DAY + hour * 3600 + minute * 60 + second - _zone_offset(parts.get("zone"))
    return total * NANOSECONDS + int((parts["fraction"] or "0").ljust(9, "0"))


def _zone_offset(zone: str | None) -> int:
    """Return the offset of a zone from UTC [s].

    >>> _zone_offset("+01:30"), _zone_offset("Z")
    (5400, 0)
    """
    if zone is None or zone in ("Z", "UTC"):
        return 0
    digits = zone[1:].replace(":", "")
    return (-1 if zone[0] == "-" else 1) * (int(digits[:2]) * 3600 + int(digits[2:]) * 60)


def _over_midnight(seconds: FloatArray) -> FloatArray:
    """Add a day to the times of the day after each midnight."""
    valid = np.flatnonzero(np.isfinite(seconds))
    days = np.cumsum(np.diff(seconds[valid]) < -MIN_STEP_OVER_MIDNIGHT)
    result = seconds.copy()
    result[valid[1:]] += DAY * days
    return result
