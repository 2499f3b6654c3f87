"""The track under every wheelset at the time steps of a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from tests.third_program.contact import Rails

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Run:
    """A run at t [s]: distance of the leading wheelset [m], lateral deviation [m] and cross-level [rad] of the track.

    t is equally spaced; s may grow at a varying speed.
    """

    t: Floats
    s: Floats
    yw: Floats
    phiw: Floats

    @property
    def interval(self) -> float:
        """Time between samples [s]."""
        return float((self.t[-1] - self.t[0]) / (len(self.t) - 1))

    def speed(self) -> Floats:
        """Speed at the samples [m/s]."""
        return np.asarray(CubicSpline(self.t, self.s)(self.t, 1))


class RailTable:
    """Rails under wheelsets at the time steps, `per_sample` of them between two samples of the run."""

    def __init__(self, run: Run, behind: tuple[float, ...], per_sample: int) -> None:
        self.per_sample = per_sample
        self.step = run.interval / per_sample
        self.steps = per_sample * (len(run.t) - 1)
        distance = CubicSpline(run.t, run.s)
        t = run.t[0] + self.step * np.arange(self.steps + 1)
        s, v = distance(t), distance(t, 1)
        columns = CubicSpline(run.s, np.stack([run.yw, run.phiw], axis=1))
        self.rails: list[list[Rails]] = []
        for lag in behind:
            under = np.maximum(s - lag, run.s[0])
            moving = np.where(s - lag >= run.s[0], v, 0.0)
            (y, phi), (dy, dphi) = columns(under).T, columns(under, 1).T
            rows = np.stack([y, moving * dy, phi, moving * dphi, v], axis=1)
            self.rails.append([Rails(*row) for row in rows.tolist()])

    def under(self, wheelset: int, t: float) -> Rails:
        """Rails under a wheelset, counted from 0, at the step nearest to t [s] after the start."""
        rails = self.rails[wheelset]
        return rails[min(round(t / self.step), len(rails) - 1)]
