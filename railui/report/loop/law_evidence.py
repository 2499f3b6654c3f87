"""Evidence for the law of an identified effect: confidence band of its force, nonparametric estimate under it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.identification.component_force import elements_at_port, restoring_force
from railui.identification.unmodelled.nonparametric import estimate_force_points
from railui.report.loop.force_evaluation import EvaluationWindow
from railui.report.numbers import CONFIDENCE_FACTOR
from railui.vehicle.model import Model
from railui.vehicle.sampling import covariance_root

DRAWS, SEED = 40, 5  # of the estimated parameters
MAX_SAMPLES = 100_000  # of a segment, beyond which no band is computed
POINTS = 25  # of the nonparametric estimate
TAIL_SHARE = 0.005  # of the samples at either end of the motion, beyond its outermost points
MIN_SAMPLES_PER_POINT = 20
MAX_ERROR_SHARE = 0.5  # of the range of the law, of the median error of the points that are shown


@dataclass(frozen=True, eq=False)
class LawEvidence:
    """Evidence of the data for a force beyond its estimated law.

    Attributes
    ----------
    half_width
        Half of the 95 % band of the force [n]; None: not computed.
    motion, force, error
        Points of the nonparametric estimate and half of their 95 % intervals [point]; empty: not estimated.
    """

    half_width: FloatArray | None
    motion: FloatArray
    force: FloatArray
    error: FloatArray


def effect_force(model: Model, index: int, w: int, z: FloatArray, v: FloatArray, dt: float) -> FloatArray:
    """Return the force [n] with which an effect alone resists a motion, with that of the elements that it replaces."""
    effect = model.design.effects[index]
    _, k, c, _ = elements_at_port(model, effect.at, w)
    superseded = str(core.effect_record(effect.kind)["supersedes"] or "")
    force = restoring_force(z, dt, [effect], k, c)[0] - restoring_force(z, dt, [], k, c)[0]
    return np.asarray(force + ("stiffness" in superseded) * k * z + ("damping" in superseded) * c * v)


def law_evidence(
    evaluation: EvaluationWindow, index: int, w: int, z: FloatArray, v: FloatArray, against: str, rest: FloatArray
) -> LawEvidence:
    """Compute the band and the points of the force of an effect alone.

    Parameters
    ----------
    evaluation
        Of the final model.
    index, w
        Of the effect in the design, and the number of its port.
    z, v
        Displacement and velocity [n] at the port.
    against
        Abscissa of the points, "z" or "v".
    rest
        Force [n] of all else at the port, which is added to the points.
    """
    dt = evaluation.segment.dt
    half_width = None
    if len(z) <= MAX_SAMPLES:
        half_width = force_band(evaluation, lambda model: effect_force(model, index, w, z, v, dt))
    points = _points(evaluation, index, w, z, v, against, rest)
    return LawEvidence(half_width, *points)


def force_band(evaluation: EvaluationWindow, force_of: Callable[[Model], FloatArray]) -> FloatArray | None:
    """Return half of the 95 % band [n] of a force over the covariance of the estimated parameters; None: unknown."""
    fit = evaluation.result.after
    if not np.all(np.isfinite(fit.covariance)):
        return None
    root = covariance_root(fit.covariance)
    steps = root @ np.random.default_rng(SEED).standard_normal((len(root), DRAWS))
    forces = []
    for step in steps.T:
        x = np.clip(fit.x + step, fit.free.low, fit.free.high)
        try:
            forces.append(force_of(fit.model.with_path_values(fit.free.paths, x)))
        except ValueError:  # too stiff to be integrated
            return None
    return np.asarray(CONFIDENCE_FACTOR * np.std(forces, axis=0))


def _points(
    evaluation: EvaluationWindow, index: int, w: int, z: FloatArray, v: FloatArray, against: str, rest: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return motion, resisting force and 95 % error [point] of the nonparametric estimate; empty without one."""
    nothing = np.zeros(0), np.zeros(0), np.zeros(0)
    model, settled = evaluation.model, evaluation.settled
    effect = model.design.effects[index]
    _, k, c, _ = elements_at_port(model, effect.at, w)
    x = (z if against == "z" else v)[settled]
    force = effect_force(model, index, w, z, v, evaluation.segment.dt)[settled]
    reach = float(np.quantile(np.abs(x), 1.0 - 2.0 * TAIL_SHARE))
    if reach <= 0.0:
        return nothing
    grid = np.linspace(-reach, reach, POINTS)
    # the linear elements that the effect replaces act again where a curve stands in its place
    superseded = str(core.effect_record(effect.kind)["supersedes"] or "")
    linear = ("stiffness" in superseded) * k * z[settled] + ("damping" in superseded) * c * v[settled]
    start = _means_at(grid, x, force - linear)
    found = estimate_force_points(
        evaluation.result.context, evaluation.result.after, index, against, grid, -(start - start[POINTS // 2])
    )
    if found is None:
        return nothing
    replaced, others = _means_at(grid, x, linear), _means_at(grid, x, rest[settled])
    total = -found.force + start[POINTS // 2] + replaced + others
    counts = np.histogram(x, bins=np.append(grid - 0.5 * (grid[1] - grid[0]), np.inf))[0]
    used = (counts >= MIN_SAMPLES_PER_POINT) & np.isfinite(total)
    error = CONFIDENCE_FACTOR * found.sd[used]
    if not np.any(used) or np.median(error) > MAX_ERROR_SHARE * np.ptp(force):
        return nothing  # the data do not determine a free curve
    return grid[used], total[used], error


def _means_at(grid: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return at each point of a grid the mean of y near it, less the slope over its bin; interpolated where empty."""
    nearest = np.clip(np.rint((x - grid[0]) / (grid[1] - grid[0])).astype(int), 0, len(grid) - 1)
    counts = np.bincount(nearest, minlength=len(grid))
    sums = np.bincount(nearest, weights=y, minlength=len(grid))
    centres = np.bincount(nearest, weights=x, minlength=len(grid))
    found = counts > 0
    return np.asarray(np.interp(grid, centres[found] / counts[found], sums[found] / counts[found]))
