"""Input tables: what drives the vehicle, one row per half step, from splines of track and run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray
from railui.core import Spline
from railui.track.line import Track, check_increasing

COLUMNS: Final = (
    *("s", "v"),
    *("yw1", "dyw1", "phiw1", "dphiw1", "gauge1"),  # leading wheelset; d: per metre
    *("yw2", "dyw2", "phiw2", "dphiw2", "gauge2"),  # trailing wheelset, at s - 2 a
    *("Qy", "Qpsi"),
)
FIRST_WHEELSET_COLUMN: Final = 2  # column where the leading wheelset's five begin
COLUMNS_PER_WHEELSET: Final = 5
Wheelbase = float | tuple[float, ...]


def wheelset_distances(wheelbase: Wheelbase) -> tuple[float, ...]:
    """How far each wheelset runs behind the first [m], of half the wheelbase of a bogie or of those distances.

    >>> distances_behind(1.25), distances_behind((0.0, 2.5, 19.0, 21.5))
    ((0.0, 2.5), (0.0, 2.5, 19.0, 21.5))
    """
    behind = (0.0, 2.0 * wheelbase) if isinstance(wheelbase, int | float) else tuple(float(x) for x in wheelbase)
    if not behind or behind[0] != 0 or not all(0 <= x < np.inf for x in behind):
        raise ValueError(f"wheelsets must run behind the first, which is half the wheelbase 0 or more: {wheelbase} m")
    return behind


def input_table(
    t: ArrayLike,
    s: ArrayLike,
    v: ArrayLike,
    yw: ArrayLike,
    phiw: ArrayLike | None,
    gauge: ArrayLike | None,
    half_wheelbase: Wheelbase,
    steps: int,
    qy: ArrayLike | None = None,
    qpsi: ArrayLike | None = None,
) -> FloatArray:
    """The table of half steps that drives a vehicle, shape [2 steps (n - 1) + 1, 14], columns `COLUMNS`.

    Instead of half the wheelbase of a bogie: the distances of all wheelsets behind the first [m], (0, ...); the
    table then has 4 + 5 columns per wheelset.

    t [s], s [m], v [m/s], yw [m], phiw [rad], gauge [m], qy [N], qpsi [N m] have n values each (None: 0);
    `steps` Runge-Kutta steps lie between two samples. Track is a not-a-knot cubic spline in s with its own
    derivative; the trailing wheelset meets it at s - 2 half_wheelbase [m], and before the first sample its
    value is held. s, v, qy, qpsi are cubic splines in t; with v constant and s = s_0 + v (t - t_0) they are
    taken exactly so. Between samples the half steps are equal parts of the interval. Raises ValueError for
    columns of unequal length, too short or not increasing, and for steps that are no power of two. Source:
    Broersen 1976, (3.6), (3.7).

    >>> import numpy as np
    >>> t = np.arange(5) * 0.1
    >>> table = input_table(t, 20 * t, np.full(5, 20.0), 1e-3 * t, None, None, 1.25, 1)
    >>> table.shape, table[1, :4].round(9).tolist()
    ((9, 14), [1.0, 20.0, 5e-05, 5e-05])
    """
    time = _column("t", t)
    n = time.size
    place, speed = _column("s", s, n), _column("v", v, n)
    if n < 4:
        raise ValueError(f"a table needs 4 samples for its splines, here are {n}")
    if steps < 1 or steps & (steps - 1):
        raise ValueError(f"steps per sample must be a power of two: {steps}")
    behind = wheelset_distances(half_wheelbase)
    if np.any(np.diff(time) <= 0):
        raise ValueError(f"time must increase: it does not after sample {int(np.argmin(np.diff(time)))}")
    check_increasing(place)

    coach = FIRST_WHEELSET_COLUMN + COLUMNS_PER_WHEELSET * len(behind)
    table = np.zeros((2 * steps * (n - 1) + 1, coach + 2))
    run_on = place[0] + speed[0] * (time - time[0])
    rounding = 1e-12 * max(abs(place[0]), abs(place[-1]), 1.0)
    uniform = bool(np.all(speed == speed[0]) and np.max(np.abs(place - run_on)) <= rounding)
    table[:, 0] = _in_equal_parts(place, 2 * steps) if uniform else _in_time(time, place, steps)
    table[:, 1] = speed[0] if uniform else _in_time(time, speed, steps)
    for index, name, values in ((coach, "Qy", qy), (coach + 1, "Qpsi", qpsi)):
        if values is not None:
            table[:, index] = _in_time(time, _column(name, values, n), steps)

    given = (("yw", yw), ("phiw", phiw), ("gauge", gauge))
    track = [np.zeros(n) if values is None else _column(name, values, n) for name, values in given]
    _lay_track(table, place, track, behind)
    return table


def _lay_track(table: FloatArray, place: FloatArray, track: list[FloatArray], behind: Sequence[float]) -> None:
    """Write the track under every wheelset into the table."""
    moving = [i for i in range(3) if np.any(track[i])]  # a column of zeros needs no spline
    if not moving:
        return
    spline = Spline(place, np.stack([track[i] for i in moving], axis=1))
    for number, distance in enumerate(behind):
        base, at = FIRST_WHEELSET_COLUMN + COLUMNS_PER_WHEELSET * number, table[:, 0] - distance
        before = at < place[0] - 1e-9  # a nanometre: rounding of s - 2 a decides nothing
        held = np.maximum(at, place[0]) if distance else at
        value, slope = spline(held), spline(held, 1)
        for j, i in enumerate(moving):
            table[:, base + 2 * i] = value[:, j]
            if i < 2:  # gauge is used as it is, without its derivative
                table[:, base + 2 * i + 1] = np.where(before & (distance > 0), 0.0, slope[:, j])


def add_track(
    table: FloatArray, s: FloatArray, more: Sequence[FloatArray | None], half_wheelbase: Wheelbase
) -> FloatArray:
    """A table with more track under every wheelset: yw, phiw, gauge [n] at the places s [m] (None: nothing).

    Splines add up: what comes out is the table of the sum of both tracks, to rounding.
    """
    out = table.copy()
    moving = [i for i in range(3) if more[i] is not None]
    if not moving:
        return out
    splines = Spline(s, np.stack([x for x in more if x is not None], axis=1)).coefficients
    for number, distance in enumerate(wheelset_distances(half_wheelbase)):
        base, at = FIRST_WHEELSET_COLUMN + COLUMNS_PER_WHEELSET * number, table[:, 0] - distance
        held = np.maximum(at, s[0]) if distance else at
        interval = np.clip(np.searchsorted(s, held, side="right") - 1, 0, len(s) - 2)
        x = held - s[interval]
        for i, factors in zip(moving, splines, strict=True):
            c3, c2, c1, c0 = np.take(factors, interval, axis=1)
            out[:, base + 2 * i] += ((c3 * x + c2) * x + c1) * x + c0
            if i < 2:
                slope = (3.0 * c3 * x + 2.0 * c2) * x + c1
                out[:, base + 2 * i + 1] += np.where((at < s[0] - 1e-9) & (distance > 0), 0.0, slope)
    return out


def _column(name: str, values: ArrayLike, n: int | None = None) -> FloatArray:
    column = np.asarray(values, dtype=np.float64)
    if column.ndim != 1 or (n is not None and column.size != n):
        raise ValueError(f"column {name} has shape {column.shape}, t has {n} values")
    if not np.all(np.isfinite(column)):
        at = int(np.flatnonzero(~np.isfinite(column))[0])
        raise ValueError(f"column {name} is not finite at sample {at}")
    return column


def _in_equal_parts(samples: FloatArray, parts: int) -> FloatArray:
    """Samples with parts - 1 points laid evenly between each two, shape [parts (n - 1) + 1]."""
    fraction = np.arange(parts) / parts
    between = samples[:-1, None] + np.diff(samples)[:, None] * fraction
    return np.append(between.ravel(), samples[-1])


def _in_time(time: FloatArray, values: FloatArray, steps: int) -> FloatArray:
    """Values at the half steps, by the cubic spline in time; the samples themselves to the last digit."""
    if np.all(values == values[0]):
        return np.full(2 * steps * (time.size - 1) + 1, values[0])
    found = Spline(time, values)(_in_equal_parts(time, 2 * steps))
    found[:: 2 * steps] = values
    return found


def distance_from_speed(t: ArrayLike, v: ArrayLike) -> FloatArray:
    """Distance [m] from the first sample: the integral of the cubic spline of v [m/s] over t [s].

    >>> [round(float(x), 9) for x in distance([0.0, 1.0, 2.0, 3.0], [0.0, 2.0, 4.0, 6.0])]
    [0.0, 1.0, 4.0, 9.0]
    """
    time = _column("t", t)
    powers = np.diff(time) ** np.arange(4, 0, -1)[:, None] / np.arange(4, 0, -1)[:, None]
    factors = Spline(time, _column("v", v, time.size)).coefficients[0]
    return np.cumsum([0.0, *np.sum(factors * powers, axis=0)])


def run_table(columns: Mapping[str, ArrayLike], half_wheelbase: Wheelbase, steps: int) -> tuple[FloatArray, float]:
    """The table of one unbroken stretch of a measured run, and the interval dt [s] of its samples.

    `columns` by their names in the run file: t, v, yw, and s, phiw, gauge, Qy, Qpsi where measured (s
    absent: the integral of v). A window from sample i to k of the stretch is rows 2 steps i to 2 steps k,
    both included. Raises ValueError as `input_table`, and for a missing column.

    >>> import numpy as np
    >>> t = np.arange(100) / 100
    >>> table, dt = run_table({"t": t, "v": 30 + t, "yw": 1e-3 * np.sin(t)}, half_wheelbase=1.28, steps=2)
    >>> table.shape, round(dt, 12)
    ((397, 14), 0.01)
    """
    missing = [name for name in ("t", "v", "yw") if name not in columns]
    if missing:
        raise ValueError(f"a run needs the columns t, v and yw: {', '.join(missing)} missing")
    t = _column("t", columns["t"])
    s = columns["s"] if "s" in columns else distance_from_speed(t, columns["v"])
    track = (columns["yw"], columns.get("phiw"), columns.get("gauge"))
    coach = (columns.get("Qy"), columns.get("Qpsi"))
    table = input_table(t, s, columns["v"], *track, half_wheelbase, steps, *coach)
    return table, float((t[-1] - t[0]) / (t.size - 1))


def track_table(track: Track, speed: float, half_wheelbase: Wheelbase, steps: int) -> tuple[FloatArray, float]:
    """The table of a track at constant speed [m/s], one sample per track sample, and dt = spacing/speed [s].

    Raises ValueError as `input_table`, and for a speed that is not positive.

    >>> from railui.track import synthetic_track
    >>> table, dt = track_table(synthetic_track("erri_b176_low"), speed=40.0, half_wheelbase=1.28, steps=1)
    >>> table.shape, round(dt, 12)
    ((19999, 14), 0.0025)
    """
    if not 0 < speed < np.inf:
        raise ValueError(f"speed must be positive: {speed:g} m/s")
    time = (track.s - track.s[0]) / speed
    v = np.full(len(track), float(speed))
    table = input_table(time, track.s, v, track.yw, track.phiw, track.gauge, half_wheelbase, steps)
    return table, track.spacing / float(speed)
