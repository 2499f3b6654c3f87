"""Numbers that recorders write where they have no value, and that are no measurements."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from railui.arrays import FloatArray

MAX_FLOAT32 = float(np.finfo(np.float32).max)
# customary marks of a missing value, of either sign, in the unit of the file: nines of loggers and track recording
# cars, ends of 16-bit integers, large powers of ten, fill values of netCDF and ends of the floating point formats
MARKS = (
    *(99.0, 999.0, 9999.0, 99999.0, 999999.0, 99.99, 999.99, 9999.99, 999.25),
    *(32767.0, 32768.0, 1e20, 1e30, 1e31, 1e35, 1e36, 9.969209968386869e36),
    *(MAX_FLOAT32, float(np.finfo(np.float64).max)),
)
ROUNDED = [float(np.float32(x)) for x in MARKS if x <= MAX_FLOAT32]  # as a channel of 32 bits gives them
SENTINELS = np.unique([*MARKS, *ROUNDED, *(-x for x in MARKS), *(-x for x in ROUNDED)])
MIN_OTHERS = 100  # other values; fewer do not show how large the channel is
QUANTILE = 0.999  # of the magnitudes of all other values
MIN_RATIO = 20.0  # of a sentinel to that quantile
MIN_REPEATED_RATIO = 5.0  # of a sentinel that occurs several times to the largest magnitude of all others


def without_sentinels(name: str, values: FloatArray, unit: str | None) -> tuple[FloatArray, list[str]]:
    """Return the values of a channel [n], NaN where they are a mark of a missing value, and a note on each mark.

    A mark equals one of `SENTINELS`, and is far from all other values of the channel.

    >>> x = np.sin(np.arange(200.0))
    >>> x[7:9] = -9999.0
    >>> without_sentinels("e1", x, "mm")[1]
    ['e1: 2 values of -9999 mm are gaps: a mark of missing values']
    """
    is_mark = np.isin(values, SENTINELS)
    if not is_mark.any():
        return values, []
    others = np.abs(values[np.isfinite(values) & ~is_mark])
    if others.size < MIN_OTHERS:
        return values, []
    usual, largest = float(np.quantile(others, QUANTILE)), float(np.max(others))
    result, notes = values, []
    for mark in np.unique(values[is_mark]).tolist():
        rows = values == mark
        count = int(np.count_nonzero(rows))
        is_repeated_far = count > 1 and abs(mark) > MIN_REPEATED_RATIO * largest
        if is_repeated_far or abs(mark) > MIN_RATIO * usual:
            result = np.where(rows, np.nan, result)
            value = f"{mark:.7g} {unit or ''}".strip()
            what = f"{count} values of {value} are gaps" if count > 1 else f"a value of {value} is a gap"
            notes.append(f"{name}: {what}: a mark of missing values")
    return result, notes


def gaps_at_sentinels(
    columns: Mapping[str, FloatArray], units: Mapping[str, str | None], clock: str | None = None
) -> tuple[dict[str, FloatArray], list[str]]:
    """Return columns without the marks of missing values, the clock as it is, and a note on each mark."""
    measured, notes = dict(columns), []
    for name in columns:
        if name != clock:
            measured[name], marks = without_sentinels(name, columns[name], units.get(name))
            notes += marks
    return measured, notes
