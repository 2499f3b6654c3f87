"""scipy: solve_ivp over the spline of the track, with the rate in Python or compiled by numba."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from tests.bench.peers import numba_peer
from tests.bench.peers.bogie import written
from tests.bench.peers.job import Answers, Job

VERSION = f"scipy {scipy.__version__}"
METHOD, RELATIVE, ABSOLUTE = "DOP853", 1e-3, 1e-7  # the quickest of scipy's whose answers come within 1e-4


def factor(square: float) -> float:
    q = math.sqrt(square)
    return 1.0 - q / 3.0 + square / 27.0 if q < 3.0 else 1.0 / q


def factors(square: NDArray[np.float64]) -> NDArray[np.float64]:
    q = np.sqrt(square)
    return np.where(q < 3.0, 1.0 - q / 3.0 + square / 27.0, 1.0 / np.maximum(q, 1.0))


def beyond(e: float, h: float) -> float:
    return e - min(max(e, -h), h)


def as_it_is(function):  # type: ignore[no-untyped-def]
    return function


def cubics(job: Job) -> NDArray[np.float64]:
    """Polynomials of the track [piece, column, power] in the distance from a sample; the first holds its start."""
    track = job.way.track
    r = job.model.design.value("vehicle.geometry.rolling_radius")
    line, roll = (CubicSpline(track.s, values) for values in (track.yw + r * track.phiw, track.phiw))
    slope = CubicSpline(track.s, track.yw).derivative()
    columns = [
        line.c,
        roll.c,
        *(np.vstack([np.zeros((1, each.c.shape[1])), each.c]) for each in (slope, roll.derivative())),
    ]
    pieces = np.stack(columns, axis=1).transpose(2, 1, 0)[: job.samples + 1]
    held = np.zeros((1, 4, 4))
    held[0, :2, 3] = pieces[0, :2, 3]
    return np.ascontiguousarray(np.vstack([held, pieces]))


def rate_of(job: Job, compiled: bool) -> Callable[..., Any]:
    """rate(t, x, c, pieces) of the bogie where the steps want it."""
    jit: Any = numba_peer.inlined if compiled else as_it_is
    laws = (numba_peer.factor, numba_peer.beyond) if compiled else (factor, beyond)
    accelerations, v, spacing = written(job.full, *laws, jit), job.way.speed, job.way.track.spacing
    wheelbase = 2 * job.model.design.value("vehicle.geometry.half_wheelbase")

    @jit
    def at(pieces, s):  # type: ignore[no-untyped-def]
        k = math.floor(s / spacing) if s > 0 else -1
        p, d = pieces[k + 1], s - k * spacing if s > 0 else 0.0
        return (
            ((p[0][0] * d + p[0][1]) * d + p[0][2]) * d + p[0][3],
            ((p[1][0] * d + p[1][1]) * d + p[1][2]) * d + p[1][3],
            ((p[2][0] * d + p[2][1]) * d + p[2][2]) * d + p[2][3],
            ((p[3][0] * d + p[3][1]) * d + p[3][2]) * d + p[3][3],
        )

    @jit
    def rate(t, x, c, pieces):  # type: ignore[no-untyped-def]
        track = (*at(pieces, v * t), *at(pieces, v * t - wheelbase))
        return (*x[6:], *accelerations(x, c, track))

    if not compiled:
        return lambda t, x, c, pieces: rate(t, tuple(x.tolist()), c, pieces)

    @numba_peer.njit(fastmath=True, error_model="numpy")
    def of_array(t, x, c, pieces):  # type: ignore[no-untyped-def]
        y = (x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11])
        return np.array(rate(t, y, c, pieces))

    return of_array  # type: ignore[no-any-return]


def prepare(job: Job, compiled: bool) -> Callable[[], Answers]:
    """The job, design after design, with the steps that scipy chooses."""
    rate, pieces = rate_of(job, compiled), cubics(job)
    all_at_once = written(job.full, factors, lambda e, h: e - np.clip(e, -h, h), as_it_is)
    t, rows = job.dt * np.arange(job.samples), job.track[::2].T
    lists = [each if compiled else each.tolist() for each in (job.c.T.copy(), pieces)]

    def rides() -> Answers:
        result = []
        for c in lists[0]:
            setting = {"method": METHOD, "rtol": RELATIVE, "atol": ABSOLUTE}
            x = solve_ivp(rate, (t[0], t[-1]), np.zeros(12), t_eval=t, args=(c, lists[1]), **setting).y
            result.append((x[2] - rows[0], x[4] - rows[4], all_at_once(x, c, rows)[0]))
        series = np.array(result).transpose(1, 0, 2)
        return job.of_series(series[:2], series[2])

    return rides
