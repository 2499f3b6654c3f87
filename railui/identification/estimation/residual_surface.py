"""Residual force of a component on a bench over the plane of displacement and velocity (a restoring force surface).

A law of the displacement and a law of the velocity add up to a surface without interaction. Friction that grows with
the deflection, as of a wedge, does not: no curve shows it, and it is coherent with no motion. Masri and Caughey, J.
Appl. Mech. 46 (1979) 433.
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


class _Residual(NamedTuple):
    """Residual force, displacement and velocity [n] of some runs."""

    force: FloatArray
    motion: tuple[FloatArray, FloatArray]

    def intervals(self, edges: Sequence[FloatArray]) -> list[NDArray[np.intp]]:
        """Interval of displacement and of velocity in which every sample is."""
        return [np.searchsorted(e, x) for e, x in zip(edges, self.motion, strict=True)]


def surface_shares(model: Model, estimation: Sequence[Segment], validation: Sequence[Segment]) -> SurfaceShares | None:
    """Compute the shares of a component's residual force; None where the model diverges or nothing is left."""
    known, unseen = _residual(model, estimation), _residual(model, validation)
    if known is None or unseen is None or not np.any(unseen.force):
        return None
    edges = [np.quantile(x, np.linspace(0.0, 1.0, INTERVALS + 1)[1:-1]) for x in known.motion]

    def share(indicators: Callable[[Sequence[NDArray[np.intp]]], FloatArray]) -> float:
        design, unseen_design = indicators(known.intervals(edges)), indicators(unseen.intervals(edges))
        means, *_ = np.linalg.lstsq(design.T @ design, design.T @ known.force, rcond=1e-9)
        return 1.0 - float(np.sum((unseen.force - unseen_design @ means) ** 2) / np.sum(unseen.force**2))

    return SurfaceShares(share(_cells), share(_additive))


def _residual(model: Model, segments: Sequence[Segment]) -> _Residual | None:
    """Residual of all segments; None where the model diverges."""
    parts = []
    for segment in segments:
        series, diverged = Predictor(model, segment).simulate([FORCE, SPEED])
        if diverged[0] >= 0:
            return None
        parts.append((segment.columns[FORCE] - series[0][0], segment.columns["z"], series[0][1]))
    step = -(-sum(len(force) for force, _, _ in parts) // MAX_SAMPLES)
    force, z, v = (np.concatenate(column)[::step] for column in zip(*parts, strict=True))
    return _Residual(force - force.mean(), (z, v))


def _cells(intervals: Sequence[NDArray[np.intp]]) -> FloatArray:
    """Indicator [n, cell] of the cell of every sample."""
    return np.asarray(np.eye(INTERVALS**2)[intervals[0] * INTERVALS + intervals[1]])


def _additive(intervals: Sequence[NDArray[np.intp]]) -> FloatArray:
    """Indicators [n, interval] of the displacement, then of the velocity."""
    return np.hstack([np.eye(INTERVALS)[interval] for interval in intervals])
