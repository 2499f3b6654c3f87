"""numba: RK4 compiled with fastmath, design by design, and sixteen designs side by side for its vectoriser."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numba
import numpy as np
from numba import njit

from tests.bench.peers.bogie import CONTACT, SUSPENSION, stepping, written
from tests.bench.peers.job import Answers, Job

VERSION = f"numba {numba.__version__}"
ROWS = 19  # of what a design carries along: twelve states, six sums, the frame's acceleration
inlined = njit(fastmath=True, error_model="numpy", forceinline=True)


@inlined
def factor(square):  # type: ignore[no-untyped-def]
    q = math.sqrt(square)
    return 1.0 - q / 3.0 + square / 27.0 if q < 3.0 else 1.0 / q


@inlined
def beyond(e, h):  # type: ignore[no-untyped-def]
    return e - min(max(e, -h), h)


moved, ended = stepping(inlined)


@inlined
def weigh(z, n, sections, begins, w, memory_0, memory_1, weighted):  # type: ignore[no-untyped-def]
    cascade = -1
    for s in range(len(sections)):
        b_0, b_1, b_2, a_1, a_2 = sections[s, 0], sections[s, 1], sections[s, 2], sections[s, 4], sections[s, 5]
        if begins[s]:
            cascade += 1
            for d in range(n):
                w[d] = z[18 * n + d]
        for d in range(n):
            given = w[d]
            y = b_0 * given + memory_0[s, d]
            memory_0[s, d] = b_1 * given - a_1 * y + memory_1[s, d]
            memory_1[s, d] = b_2 * given - a_2 * y
            w[d] = y
        if begins[s + 1]:
            for d in range(n):
                weighted[cascade, d] += w[d] * w[d]


@cache
def ride(full: bool, n: int) -> Callable[..., Any]:
    """The ride of n designs side by side. z is flat, row after row of n: with distances that are known when it is
    compiled, LLVM sees that designs do not meet, and takes four at once."""
    accelerations = written(full, factor, beyond, inlined)
    size = SUSPENSION + 2 * CONTACT[full]
    unpack = inlined(eval(f"lambda c, d: ({', '.join(f'c[{k}, d]' for k in range(size))})"))

    @njit(fastmath=True, error_model="numpy")
    def run(c, track, h, clearance, z, comfort):  # type: ignore[no-untyped-def]
        last = len(track) - 1
        for k in range(0, last + 1, 2):
            r = track[k], track[min(k + 1, last)], track[min(k + 2, last)]
            row_1 = (r[0][0], r[0][1], r[0][2], r[0][3], r[0][4], r[0][5], r[0][6], r[0][7])
            row_2 = (r[1][0], r[1][1], r[1][2], r[1][3], r[1][4], r[1][5], r[1][6], r[1][7])
            row_3 = (r[2][0], r[2][1], r[2][2], r[2][3], r[2][4], r[2][5], r[2][6], r[2][7])
            for d in range(n):
                own = unpack(c, d)
                first = z[d], z[n + d], z[2 * n + d], z[3 * n + d], z[4 * n + d], z[5 * n + d]
                x_1 = (*first, z[6 * n + d], z[7 * n + d], z[8 * n + d], z[9 * n + d], z[10 * n + d], z[11 * n + d])
                e_1, e_2 = x_1[2] - row_1[0], x_1[4] - row_1[4]
                z[12 * n + d] += e_1
                z[13 * n + d] += e_1 * e_1
                if full:
                    z[14 * n + d] += 1.0 if abs(e_1) >= clearance else 0.0
                    z[15 * n + d] += e_2
                    z[16 * n + d] += e_2 * e_2
                    z[17 * n + d] += 1.0 if abs(e_2) >= clearance else 0.0
                a_1 = accelerations(x_1, own, row_1)
                z[18 * n + d] = a_1[0]
                x_2 = moved(x_1, x_1, a_1, 0.5 * h)
                a_2 = accelerations(x_2, own, row_2)
                x_3 = moved(x_1, x_2, a_2, 0.5 * h)
                a_3 = accelerations(x_3, own, row_2)
                x_4 = moved(x_1, x_3, a_3, h)
                x = ended(x_1, x_2, x_3, x_4, accelerations(x_4, own, row_3), h)
                z[d], z[n + d], z[2 * n + d], z[3 * n + d], z[4 * n + d], z[5 * n + d] = x[:6]
                z[6 * n + d], z[7 * n + d], z[8 * n + d], z[9 * n + d], z[10 * n + d], z[11 * n + d] = x[6:]
            if full:
                weigh(z, n, *comfort)

    return run


def prepare(job: Job, side_by_side: int) -> Callable[[], Answers]:
    """The job, so many designs at a time."""
    n, designs, run = side_by_side, len(job.rows), ride(job.full, side_by_side)
    cascades = list(job.named_sections.values())
    sections = np.vstack(cascades) if cascades else np.zeros((0, 6))
    begins = np.array([i == 0 for one in cascades for i in range(len(one))] + [True])

    def rides() -> Answers:
        sums, weighted = np.zeros((6, designs)), np.zeros((len(cascades), designs))
        for at in range(0, designs, n):
            z, squares = np.zeros(ROWS * n), np.zeros((len(cascades), n))
            memory = np.zeros((len(sections), n)), np.zeros((len(sections), n))
            own = np.ascontiguousarray(job.c[:, at : at + n])
            run(own, job.track, job.dt, job.clearance, z, (sections, begins, np.zeros(n), *memory, squares))
            sums[:, at : at + n] = z.reshape(ROWS, n)[12:18]
            weighted[:, at : at + n] = squares
        wheelsets = 2 if job.full else 1
        each = (sums[[i, i + 3]][:wheelsets] for i in range(3))
        return job.of_sums(*each, weighted if job.full else None)

    return rides
