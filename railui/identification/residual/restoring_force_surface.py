"""Residual force of a component on a bench over the plane of displacement and velocity (a restoring force surface).

A law of the displacement and a law of the velocity add up to a surface without interaction. Friction that grows with
the deflection, as of a wedge, does not: no curve shows it, and it is coherent with no motion. Masri and Caughey, J.
Appl. Mech. 46 (1979) 433. In a sweep a part of the plane is visited at one time only, so that a force which changes
with time or frequency would look like such a law: surfaces of either half of the runs must therefore hold in the other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.segment import Segment
from railui.identification.prediction import Predictor
from railui.vehicle.model import Model

INTERVALS = 6  # of displacement and of velocity, with as many samples each
MAX_SAMPLES = 50_000  # of the runs of a role, of which every n-th is then used
FORCE, SPEED = "F", "v.rig.0"


class SurfaceShares(NamedTuple):
    """Shares of the squared residual force on the validation runs that surfaces of the estimation runs explain.

    joint: the mean in every cell of the plane. additive: a function of the displacement plus one of the velocity.
    """

    joint: float
    additive: float

    @property
    def interaction(self) -> float:
        """Share that displacement and velocity explain together beyond a function of each."""
        return self.joint - max(self.additive, 0.0)


class _Residual(NamedTuple):
    """Residual force, displacement and velocity [n] of some runs."""

    force: FloatArray
    motion: tuple[FloatArray, FloatArray]

    def intervals(self, edges: Sequence[FloatArray]) -> list[NDArray[np.intp]]:
        """Interval of displacement and of velocity in which every sample is."""
        return [np.searchsorted(e, x) for e, x in zip(edges, self.motion, strict=True)]


def surface_shares(model: Model, estimation: Sequence[Segment], validation: Sequence[Segment]) -> SurfaceShares | None:
    """Compute the shares of a component's residual force; None where the model diverges or nothing is left."""
    known, unseen = _residual_of_halves(model, estimation), _residual_of_halves(model, validation)
    if known is None or unseen is None or not any(np.any(half.force) for half in unseen):
        return None
    motions = zip(*(half.motion for half in known), strict=True)
    edges = [np.quantile(np.concatenate(x), np.linspace(0.0, 1.0, INTERVALS + 1)[1:-1]) for x in motions]

    def share(indicators: Callable[[Sequence[NDArray[np.intp]]], FloatArray]) -> float:
        left = 0.0
        for one, other in zip(known, reversed(unseen), strict=True):
            design = indicators(one.intervals(edges))
            means, *_ = np.linalg.lstsq(design.T @ design, design.T @ one.force, rcond=1e-9)
            left += float(np.sum((other.force - indicators(other.intervals(edges)) @ means) ** 2))
        return 1.0 - left / float(sum(np.sum(half.force**2) for half in unseen))

    return SurfaceShares(share(_cells), share(_additive))


def _residual_of_halves(model: Model, segments: Sequence[Segment]) -> tuple[_Residual, _Residual] | None:
    """Residual of the first halves of all segments, and of the second; None where the model diverges."""
    halves: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    step = -(-sum(s.samples for s in segments) // MAX_SAMPLES)
    for segment in segments:
        series, diverged = Predictor(model, segment).simulate([FORCE, SPEED])
        if diverged[0] >= 0:
            return None
        residual = segment.columns[FORCE] - series[0][0]
        rows = np.stack([residual - residual.mean(), segment.columns["z"], series[0][1]])[:, ::step]
        middle = rows.shape[1] // 2
        halves[0].append(rows[:, :middle])
        halves[1].append(rows[:, middle:])
    first, second = (np.concatenate(half, axis=1) for half in halves)
    return _Residual(first[0], (first[1], first[2])), _Residual(second[0], (second[1], second[2]))


def _cells(intervals: Sequence[NDArray[np.intp]]) -> FloatArray:
    """Indicator [n, cell] of the cell of every sample."""
    return np.asarray(np.eye(INTERVALS**2)[intervals[0] * INTERVALS + intervals[1]])


def _additive(intervals: Sequence[NDArray[np.intp]]) -> FloatArray:
    """Indicators [n, interval] of the displacement, then of the velocity."""
    return np.hstack([np.eye(INTERVALS)[interval] for interval in intervals])
