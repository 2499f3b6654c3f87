"""Input tables of the kernel: track and carbody forces at half steps, from splines of track and run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray
from railui.core import NoResultError, Spline
from railui.track.line import MIN_SAMPLES, Track, check_increasing
from railui.track.line_geometry import Cant, LinePositions, add_twist, line_columns

COLUMNS: Final = (
    *("s", "v"),
    *("yw1", "dyw1", "phiw1", "dphiw1", "gauge1"),  # leading wheelset; d: per metre
    *("yw2", "dyw2", "phiw2", "dphiw2", "gauge2"),  # trailing wheelset, at s - 2 a
    *("Qy", "Qpsi"),
)
FIRST_WHEELSET_COLUMN: Final = 2
COLUMNS_PER_WHEELSET: Final = 5
IRREGULARITIES: Final = ("yw", "phiw", "gauge")
WITH_DERIVATIVE: Final = 2  # of the irregularities: yw and phiw; the gauge acts without its derivative
DISTANCE_TOLERANCE: Final = 1e-12  # relative deviation of s from constant speed

Wheelbase = (
    float | tuple[float, ...]
)  # half the wheelbase of a bogie, or distances of all wheelsets behind the first [m]

Spacing = Wheelbase | LinePositions


def wheelset_distances(wheelbase: Wheelbase) -> tuple[float, ...]:
    """Return the distance [m] of each wheelset behind the first.

    `wheelbase`: half the wheelbase of a bogie, or these distances.

    >>> wheelset_distances(1.25), wheelset_distances((0.0, 2.5, 19.0, 21.5))
    ((0.0, 2.5), (0.0, 2.5, 19.0, 21.5))
    """
    behind = (0.0, 2.0 * wheelbase) if isinstance(wheelbase, int | float) else tuple(float(x) for x in wheelbase)
    if not behind or behind[0] != 0 or not all(0 <= x < np.inf for x in behind):
        raise NoResultError(
            f"wheelsets must run behind the first, which is half the wheelbase 0 or more: {wheelbase} m"
        )
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
    """Compute the table of half steps that drives a vehicle.

    The track is a not-a-knot cubic spline in s with its own derivative; the trailing wheelset is at
    s - 2 half_wheelbase, and before the first sample the track keeps its first value. s, v, qy, qpsi are cubic splines
    in t; with constant v and s = s_0 + v (t - t_0) they are exact. Between samples the half steps are equal parts of
    the interval.

    Parameters
    ----------
    t, s, v : array_like
        Time [s], distance [m] and speed [m/s], n values each.
    yw, phiw, gauge : array_like
        Lateral deviation [m], cross-level [rad] and gauge deviation [m], n values each; None for 0.
    half_wheelbase : float or tuple of float
        Half the wheelbase of a bogie [m], or the distances of all wheelsets behind the first [m], (0, ...).
    steps : int
        Runge-Kutta steps between two samples.
    qy, qpsi : array_like, optional
        Measured forces of the carbody [N], [N m], n values each.

    Returns
    -------
    FloatArray
        Table [2 steps (n - 1) + 1, 4 + 5 wheelsets]; for a bogie the columns are `COLUMNS`.

    Raises
    ------
    ValueError
        For columns of unequal length, too short or not increasing, and for less than one step.

    References
    ----------
    Broersen 1976, (3.6), (3.7).

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(5) * 0.1
    >>> table = input_table(t, 20 * t, np.full(5, 20.0), 1e-3 * t, None, None, 1.25, 1)
    >>> table.shape, table[1, :4].round(9).tolist()
    ((9, 14), [1.0, 20.0, 5e-05, 5e-05])
    """
    time = _column("t", t)
    n = time.size
    distance, speed = _column("s", s, n), _column("v", v, n)
    _check(time, distance, steps)
    behind = wheelset_distances(half_wheelbase)
    carbody = FIRST_WHEELSET_COLUMN + COLUMNS_PER_WHEELSET * len(behind)
    table = np.zeros((2 * steps * (n - 1) + 1, carbody + 2))
    at_constant_speed = distance[0] + speed[0] * (time - time[0])
    rounding = DISTANCE_TOLERANCE * max(abs(distance[0]), abs(distance[-1]), 1.0)
    is_uniform = bool(np.all(speed == speed[0]) and np.max(np.abs(distance - at_constant_speed)) <= rounding)
    table[:, 0] = _subdivide(distance, 2 * steps) if is_uniform else _interpolate(time, distance, steps)
    table[:, 1] = speed[0] if is_uniform else _interpolate(time, speed, steps)
    for column, name, values in ((carbody, "Qy", qy), (carbody + 1, "Qpsi", qpsi)):
        if values is not None:
            table[:, column] = _interpolate(time, _column(name, values, n), steps)
    given = zip(IRREGULARITIES, (yw, phiw, gauge), strict=True)
    track = [np.zeros(n) if values is None else _column(name, values, n) for name, values in given]
    _write_track(table, distance, track, behind)
    return table


def _check(time: FloatArray, distance: FloatArray, steps: int) -> None:
    """Raise ValueError for too few samples, a wrong number of steps, and time or distance that do not increase."""
    if time.size < MIN_SAMPLES:
        raise ValueError(f"a table needs {MIN_SAMPLES} samples for its splines, here are {time.size}")
    if steps < 1:
        raise ValueError(f"steps per sample must be positive: {steps}")
    if np.any(np.diff(time) <= 0):
        raise ValueError(f"time must increase: it does not after sample {int(np.argmin(np.diff(time)))}")
    check_increasing(distance)


def _write_track(table: FloatArray, s: FloatArray, track: Sequence[FloatArray | None], behind: Sequence[float]) -> None:
    """Add the track under every wheelset to the columns of a table; None or zeros: no such irregularity."""
    present = {i: values for i, values in enumerate(track) if values is not None and np.any(values)}
    if not present:
        return
    spline = Spline(s, np.stack(list(present.values()), axis=1))
    for number, distance in enumerate(behind):
        first = FIRST_WHEELSET_COLUMN + COLUMNS_PER_WHEELSET * number
        columns = [(first + 2 * i, first + 2 * i + 1 if i < WITH_DERIVATIVE else None) for i in present]
        spline.add_behind(table, distance, columns)


def add_track(
    table: FloatArray, s: FloatArray, irregularities: Sequence[FloatArray | None], half_wheelbase: Wheelbase
) -> FloatArray:
    """Return a table with additional track under every wheelset.

    Splines are additive: the result is the table of the sum of both tracks, to rounding.

    Parameters
    ----------
    table : FloatArray
        Input table.
    s : FloatArray
        Locations [n] of the additional track [m].
    irregularities : sequence of FloatArray or None
        yw, phiw, gauge [n]; None for 0.
    half_wheelbase : float or tuple of float
        As for `input_table`.
    """
    out = table.copy()
    _write_track(out, s, irregularities, wheelset_distances(half_wheelbase))
    return out


def _column(name: str, values: ArrayLike, n: int | None = None) -> FloatArray:
    """Return a column as an array; raise ValueError for a wrong shape and for values that are not finite."""
    column = np.asarray(values, dtype=np.float64)
    if column.ndim != 1 or (n is not None and column.size != n):
        raise ValueError(f"column {name} has shape {column.shape}, t has {n} values")
    if not np.all(np.isfinite(column)):
        at = int(np.flatnonzero(~np.isfinite(column))[0])
        raise ValueError(f"column {name} is not finite at sample {at}")
    return column


def _subdivide(samples: FloatArray, parts: int) -> FloatArray:
    """Return samples with each interval divided into equal parts, shape [parts (n - 1) + 1]."""
    fraction = np.arange(parts) / parts
    between = samples[:-1, None] + np.diff(samples)[:, None] * fraction
    return np.append(between.ravel(), samples[-1])


def _interpolate(time: FloatArray, values: FloatArray, steps: int) -> FloatArray:
    """Return values at the half steps by their cubic spline in time; the samples themselves are exact."""
    if np.all(values == values[0]):
        return np.full(2 * steps * (time.size - 1) + 1, values[0])
    interpolated = Spline(time, values)(_subdivide(time, 2 * steps))
    interpolated[:: 2 * steps] = values
    return interpolated


def distance_from_speed(t: ArrayLike, v: ArrayLike) -> FloatArray:
    """Return the distance [m] from the first sample: the integral of the cubic spline of v [m/s] over t [s].

    >>> [round(float(x), 9) for x in distance_from_speed([0.0, 1.0, 2.0, 3.0], [0.0, 2.0, 4.0, 6.0])]
    [0.0, 1.0, 4.0, 9.0]
    """
    time = _column("t", t)
    powers = np.diff(time) ** np.arange(4, 0, -1)[:, None] / np.arange(4, 0, -1)[:, None]
    coefficients = Spline(time, _column("v", v, time.size)).coefficients[0]
    return np.cumsum([0.0, *np.sum(coefficients * powers, axis=0)])


def run_table(columns: Mapping[str, ArrayLike], half_wheelbase: Wheelbase, steps: int) -> tuple[FloatArray, float]:
    """Compute the table of one unbroken segment of a measured run, and the interval dt [s] of its samples.

    A window from sample i to k of the segment is rows 2 steps i to 2 steps k, both included.

    Parameters
    ----------
    columns : mapping
        By their names in the run file: t, v, yw, and if measured s, phiw, gauge, Qy, Qpsi; by default s is the
        integral of v.
    half_wheelbase, steps
        As for `input_table`.

    Raises
    ------
    ValueError
        As `input_table`, and for a missing column.

    Examples
    --------
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
    carbody = (columns.get("Qy"), columns.get("Qpsi"))
    table = input_table(t, s, columns["v"], *track, half_wheelbase, steps, *carbody)
    return table, float((t[-1] - t[0]) / (t.size - 1))


def _line_table(track: Track, speed: float, places: LinePositions, steps: int) -> tuple[FloatArray, float]:
    """Compute the table of a line with curves: that of a straight track with the twist, then the line's columns."""
    straight = Track(track.s, track.yw, track.phiw, track.gauge)
    table, dt = track_table(straight, speed, places.wheelsets, steps)
    s, cant = table[:, 0], Cant(track, places.half_gauge)
    middle = cant.at(s - places.positions[-1])
    for number, behind in enumerate(places.wheelsets):
        add_twist(table, FIRST_WHEELSET_COLUMN + COLUMNS_PER_WHEELSET * number, cant.at(s - behind), middle)
    return np.ascontiguousarray(np.hstack([table, line_columns(track, speed, s, places, middle)])), dt


def track_table(track: Track, speed: float, half_wheelbase: Spacing, steps: int) -> tuple[FloatArray, float]:
    """Compute the table of a track at constant speed [m/s], one sample per track sample, and dt = spacing/speed [s].

    With `LinePositions` the columns of a line with curves follow, see `railui.track.line_geometry`.

    Raises ValueError as `input_table`, and for a speed that is not positive.

    >>> from railui.track import synthetic_track
    >>> table, dt = track_table(synthetic_track("erri_b176_low"), speed=40.0, half_wheelbase=1.28, steps=1)
    >>> table.shape, round(dt, 12)
    ((19999, 14), 0.0025)
    """
    if not 0 < speed < np.inf:
        raise ValueError(f"speed must be positive: {speed:g} m/s")
    if isinstance(half_wheelbase, LinePositions):
        return _line_table(track, speed, half_wheelbase, steps)
    time = (track.s - track.s[0]) / speed
    v = np.full(len(track), float(speed))
    table = input_table(time, track.s, v, track.yw, track.phiw, track.gauge, half_wheelbase, steps)
    return table, track.spacing / float(speed)
