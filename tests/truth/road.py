"""Excitation of a bogie along a run: rails, speed and measured coach forces between the samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from tests.truth.laws import Array


@dataclass(frozen=True)
class Table:
    """Columns of a run at the samples: t [s], s v [m, m/s], yw gauge [m], phiw [rad], Qy Qpsi [N, N*m].

    Qy and Qpsi None: the suspension of the vehicle itself acts at the coach.
    """

    t: Array
    s: Array
    v: Array
    yw: Array
    phiw: Array
    gauge: Array
    Qy: Array | None = None
    Qpsi: Array | None = None


class Point:
    """Inputs of a batch at one time, [wheelset, vehicle]; s [vehicle], Q of a measured coach [2, vehicle].

    rest is where a wheelset has e = 0, y_w + r phi_w; a d at the end is d/dt.
    """

    __slots__ = ("Q", "V", "g", "phiw", "phiwd", "rest", "restd", "s", "t")

    def __init__(self, t: float, row: Array) -> None:
        self.t = t
        self.rest, self.restd, self.phiw, self.phiwd, self.g = (
            row[0:2],
            row[2:4],
            row[4:6],
            row[6:8],
            row[8:10],
        )
        self.V, self.s, self.Q = row[10:12], row[12], row[13:15]


WIDTH = 15


class Road:
    """Splines of one table for one vehicle; the trailing wheelset is 2a behind (3.6), d/dt = V d/ds (3.7)."""

    def __init__(self, run: Table, a: float, r: float) -> None:
        self.run, self.a, self.r = run, a, r
        none = np.zeros(len(run.t))
        drives = [none if q is None else q for q in (run.Qy, run.Qpsi)]
        self.rails = CubicSpline(run.s, np.stack([run.yw, run.phiw, run.gauge], axis=1), bc_type="not-a-knot")
        self.slopes = self.rails.derivative()
        driven = run.Qy is not None or run.Qpsi is not None
        self.coach = CubicSpline(run.s, np.stack(drives, axis=1), bc_type="not-a-knot") if driven else None

    def __call__(self, t: Array) -> Array:
        """Inputs [time, field] at the times t [s]; after the last sample the last value stays."""
        run = self.run
        s, v = np.interp(t, run.t, run.s), np.interp(t, run.t, run.v)
        out = np.zeros((len(t), WIDTH))
        for i, behind in enumerate((0.0, 2.0 * self.a)):
            here = np.maximum(s - behind, run.s[0])
            moving = v * ((s - behind >= run.s[0]) & (t <= run.t[-1] + 1e-9))
            (yw, phiw, g), (dyw, dphiw, _) = self.rails(here).T, self.slopes(here).T
            out[:, 0 + i], out[:, 2 + i] = yw + self.r * phiw, moving * (dyw + self.r * dphiw)
            out[:, 4 + i], out[:, 6 + i] = phiw, moving * dphiw
            out[:, 8 + i], out[:, 10 + i] = g, v
        out[:, 12] = s
        if self.coach is not None:
            out[:, 13:15] = self.coach(s)
        return out
