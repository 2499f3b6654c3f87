"""Samples of the estimates: vehicles that reproduce the measured motions about as well as the calibrated one.

A normal distribution of the whole covariance leaves the valleys of the misfit: where the data determine a combination
of parameters only, their estimates move along a curve. A sample here is a normal deviation, from a point to which a
parameter was moved that only a prior determines, brought back into the valley and checked by its misfit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy import linalg

from railui.arrays import FloatArray
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit, HeldPoint
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.held_parameters import OUTER_WEIGHT, spread_along
from railui.identification.estimation.problem import FitSegment
from railui.identification.prediction import DivergedError
from railui.parallel import map_threads
from railui.vehicle.sampling import covariance_root

SAMPLE_SEED = 29
SHARES = (1.0, 0.5, 0.25)  # of the normal deviation, tried in turn until the misfit is low enough
CORRECTIONS = 4  # steps back into the valley
WORTHWHILE_FALL = 0.9  # of the misfit, below which a step is followed by another
DAMPINGS = (1e2, 1e4)  # of these steps, against moves along the valley: precision in that of the samples


def with_parameter_samples(context: Context, fit: Fit) -> Fit:
    """Return a fit with samples of its estimates.

    A sample whose misfit rises by more than twice the largest rise that the normal equations predict is corrected by
    steps towards the residual which they predict (randomised maximum likelihood: Oliver, He and Reynolds, 5th European
    Conference on the Mathematics of Oil Recovery (1996), here with the sensitivities at the estimates). One that stays
    above is drawn nearer: with one held parameter moved instead of several, then with less of its normal
    deviation. One that fits at no distance is left out.
    """
    count = context.settings.calibration.parameter_samples
    rng = np.random.default_rng(np.random.SeedSequence([SAMPLE_SEED, count]))
    root = covariance_root(fit.covariance - spread_along(fit.held_points, len(fit.x)))
    deviations = rng.standard_normal((count, len(fit.x))) @ root.T
    moved, moved_once = _held_changes(fit, rng.random((count, len(fit.x))))

    valley = _Valley(context, fit, deviations)
    samples = np.full((count, len(fit.x)), np.nan)
    is_several = np.any(moved != moved_once, axis=1)
    for held, share in [(moved, 1.0), *((moved_once, share) for share in SHARES)]:
        is_new = is_several | (held is moved) | (share < 1.0)
        left = np.flatnonzero(np.isnan(samples[:, 0]) & is_new)
        if left.size:
            samples[left] = valley.samples(held[left], share * deviations[left])
    return replace(fit, samples=samples[np.isfinite(samples[:, 0])])


def _held_changes(fit: Fit, chance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Changes [sample, p] of all estimates with held parameters at a point of their quadrature, and with one of them.

    chance: random numbers [sample, p] between 0 and 1.
    """
    moved = np.zeros(chance.shape)
    moved_once = np.zeros(chance.shape)
    for j in sorted({point.index for point in fit.held_points}):
        points: Sequence[HeldPoint] = [point for point in fit.held_points if point.index == j]
        for side, point in enumerate(points):
            is_there = (chance[:, j] >= side * OUTER_WEIGHT) & (chance[:, j] < (side + 1) * OUTER_WEIGHT)
            moved[is_there] += point.change
            moved_once[is_there] = point.change
    return moved, moved_once


class _Valley:
    """Points around the estimates whose misfit is about as low.

    Parameters
    ----------
    deviations
        Normal deviations [sample, p], which set the rise of the misfit that counts as low.
    """

    def __init__(self, context: Context, fit: Fit, deviations: FloatArray) -> None:
        self.fit = fit
        self.optimiser = GaussNewton.of_fit(context.in_background(context.jobs), fit)
        self.optimiser.restart_windows(fit.x)
        self.products = fit.normal.total[1:, 1:]
        self.unit = np.where(fit.sd > 0.0, fit.sd, fit.free.size)
        self.matrix = self.optimiser.equations(fit.normal, fit.x)[0] * np.outer(self.unit, self.unit)
        rise = np.einsum("np,pq,nq->n", deviations, self.products, deviations)
        self.limit = float(self.optimiser.misfit(fit.x[None])[0] + 2.0 * np.max(rise))

    def samples(self, held: FloatArray, deviations: FloatArray) -> FloatArray:
        """Return changes [n, p] of the estimates by held parameters and normal deviations, NaN where none fits."""
        fit = self.fit
        points = self._clipped(fit.x + held + deviations)
        misfit = self.optimiser.misfit(points)
        high = np.flatnonzero(np.isfinite(misfit) & (misfit > self.limit))
        for _ in range(CORRECTIONS):
            if not high.size:
                break
            changes, former = points - fit.x, misfit.copy()
            for step in self._corrections(points[high], deviations[high]):
                corrected = self._clipped(fit.x + changes[high] + step)
                there = self.optimiser.misfit(corrected)
                is_lower = there < misfit[high]
                points[high[is_lower]], misfit[high[is_lower]] = corrected[is_lower], there[is_lower]
            high = np.flatnonzero((misfit < WORTHWHILE_FALL * former) & (misfit > self.limit))
        return np.where((misfit <= self.limit)[:, None], points - fit.x, np.nan)

    def _clipped(self, x: FloatArray) -> FloatArray:
        return np.clip(x, self.fit.free.low, self.fit.free.high)

    def _corrections(self, points: FloatArray, deviations: FloatArray) -> Iterator[FloatArray]:
        """Damped steps [n, p] from points to the residuals that the normal deviations are to have."""
        optimiser, fit = self.optimiser, self.fit

        def product(target: FitSegment) -> FloatArray:
            """Products [n, p] of the sensitivities with the change of the residual; zero where it is not known."""
            try:
                rows = optimiser.sensitivities(target, fit.x).converged()[1:]
            except DivergedError:
                return np.zeros(points.shape)
            series, diverged = optimiser.simulate(target, np.vstack([fit.x, points]))
            change = target.without_initial_state(series[0] - series[1:])
            found = np.tensordot(change, rows, ([1, 2], [1, 2]))
            return np.where((diverged[1:] < 0)[:, None] & np.isfinite(found), found, 0.0)

        change = sum(map_threads(product, optimiser.segments, optimiser.context.jobs))
        scores = (change + deviations @ self.products) / fit.normal.variance
        for damping in DAMPINGS:
            yield self.unit * linalg.solve(self.matrix + damping * np.eye(len(fit.x)), (self.unit * scores).T).T
