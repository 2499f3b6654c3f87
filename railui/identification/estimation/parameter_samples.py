"""Samples of the estimates: vehicles that reproduce the measured motions about as well as the calibrated one.

A normal distribution of the whole covariance leaves the valleys of the misfit: where the data determine a combination
of parameters only, their estimates move along a curve. A sample here is a normal deviation, from a point to which a
parameter was moved that only a prior determines, brought back into the valley and checked by its misfit.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.held_parameters import OUTER_WEIGHT, spread_along, whole_change
from railui.identification.estimation.problem import FitSegment
from railui.identification.prediction import DivergedError
from railui.parallel import map_threads
from railui.vehicle.sampling import covariance_root

SAMPLE_SEED = 29
SHARES = (1.0, 0.5, 0.25)  # of the normal deviation, tried in turn until the misfit is low enough
CORRECTIONS = 4  # steps back into the valley
WORTHWHILE_FALL = 0.9  # of the misfit, below which a step is followed by another
FIXED_PRECISION = 1e12  # of a moved parameter in these steps, which the others follow
DAMPINGS = (1e2, 1e4)  # of these steps, against moves along the valley: precision in that of the samples


def with_parameter_samples(context: Context, fit: Fit) -> Fit:
    """Return a fit with samples of its estimates.

    A sample whose misfit rises by more than twice the largest rise that the normal equations predict is corrected by
    steps towards the residual which they predict (randomised maximum likelihood: Oliver, He and Reynolds, 5th European
    Conference on the Mathematics of Oil Recovery (1996), here with the sensitivities at the estimates). One that stays
    above is drawn nearer: with held parameters moved as far as a refit reached, with one of them moved instead of
    several, then with less of its normal deviation. One that fits at no distance is left out.
    """
    count = context.settings.calibration.parameter_samples
    rng = np.random.default_rng(np.random.SeedSequence([SAMPLE_SEED, count]))
    root = covariance_root(fit.covariance - spread_along(fit, fit.held_points))
    deviations = _standard_normal(rng, (count, len(fit.x))) @ root.T
    whole, reached, single = _moves(fit, _stratified(rng, deviations.shape))

    valley = _Valley(context, fit, deviations)
    samples = np.full((count, len(fit.x)), np.nan)
    former, former_share = np.full_like(deviations, np.nan), 1.0
    for moves, share in [(whole, 1.0), (reached, 1.0), *((single, share) for share in SHARES)]:
        is_new = np.any(moves.change != former, axis=1) | (share != former_share)
        left = np.flatnonzero(np.isnan(samples[:, 0]) & is_new)
        if left.size:
            samples[left] = valley.samples(moves.take(left), share * deviations[left])
        former, former_share = moves.change, share
    return replace(fit, samples=samples[np.isfinite(samples[:, 0])])


@dataclass(frozen=True, eq=False)
class _Moves:
    """Changes [sample, p] of all estimates with some parameters moved, and which are [sample, p]."""

    change: FloatArray
    is_moved: NDArray[np.bool_]

    def take(self, indices: NDArray[np.intp]) -> _Moves:
        """Return those of some samples."""
        return _Moves(self.change[indices], self.is_moved[indices])


def _standard_normal(rng: np.random.Generator, shape: tuple[int, int]) -> FloatArray:
    """Standard normal numbers [sample, p] with a mean of zero and the unit matrix as second moment.

    As they are drawn where there are too few samples for that.
    """
    drawn = rng.standard_normal(shape)
    if shape[0] <= shape[1]:
        return drawn
    q, r = np.linalg.qr(drawn - drawn.mean(axis=0))
    return np.asarray(np.sqrt(shape[0]) * q * np.sign(np.diag(r)))


def _stratified(rng: np.random.Generator, shape: tuple[int, int]) -> FloatArray:
    """Random numbers [sample, p] between 0 and 1, of each parameter one in every interval of 1/samples.

    Source: McKay, Beckman and Conover, Technometrics 21 (1979) 239: Latin hypercube sampling.
    """
    order = rng.permuted(np.tile(np.arange(shape[0])[:, None], shape[1]), axis=0)
    return np.asarray((order + rng.random(shape)) / shape[0])


def _moves(fit: Fit, chance: FloatArray) -> tuple[_Moves, _Moves, _Moves]:
    """Move the parameters that only a prior determines to points of their quadrature.

    To the whole distance of the points, as far as a refit reached, and the latter with one parameter alone. A point
    whose mirror image cannot be reached takes its place, as in the covariance.

    chance: random numbers [sample, p] between 0 and 1.
    """
    whole, reached, single = (_Moves(np.zeros(chance.shape), np.zeros(chance.shape, dtype=bool)) for _ in range(3))
    for j in sorted({point.index for point in fit.held_points}):
        points = [point for point in fit.held_points if point.index == j]
        weight = 2.0 * OUTER_WEIGHT / len(points)
        for side, point in enumerate(points):
            is_there = (chance[:, j] >= side * weight) & (chance[:, j] < (side + 1) * weight)
            whole.change[is_there] += whole_change(fit, point)
            reached.change[is_there] += point.change
            single.change[is_there] = point.change
            whole.is_moved[is_there, j] = reached.is_moved[is_there, j] = True
            single.is_moved[is_there] = np.arange(chance.shape[1]) == j
    return whole, reached, single


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
        rise = np.einsum("np,pq,nq->n", deviations, self.products, deviations)
        self.limit = float(self.optimiser.misfit(fit.x[None])[0] + 2.0 * np.max(rise))

    def samples(self, moves: _Moves, deviations: FloatArray) -> FloatArray:
        """Return changes [n, p] of the estimates by moves and normal deviations, NaN where none fits."""
        fit = self.fit
        points = self._clipped(fit.x + moves.change + deviations)
        misfit = self.optimiser.misfit(points)
        high = np.flatnonzero(np.isfinite(misfit) & (misfit > self.limit))
        for _ in range(CORRECTIONS):
            if not high.size:
                break
            changes, former = points - fit.x, misfit.copy()
            for step in self._corrections(points[high], moves.take(high), deviations[high]):
                corrected = self._clipped(fit.x + changes[high] + step)
                there = self.optimiser.misfit(corrected)
                is_lower = there < misfit[high]
                points[high[is_lower]], misfit[high[is_lower]] = corrected[is_lower], there[is_lower]
            high = np.flatnonzero((misfit < WORTHWHILE_FALL * former) & (misfit > self.limit))
        return np.where((misfit <= self.limit)[:, None], points - fit.x, np.nan)

    def _clipped(self, x: FloatArray) -> FloatArray:
        return np.clip(x, self.fit.free.low, self.fit.free.high)

    def _corrections(self, points: FloatArray, moves: _Moves, deviations: FloatArray) -> Iterator[FloatArray]:
        """Damped steps [n, p] from points to the residuals that the normal deviations are to have.

        The sensitivities are those at the point to which parameters were moved; these stay.
        """
        fit, unit = self.fit, self.unit
        centers, group = np.unique(self._clipped(fit.x + moves.change), axis=0, return_inverse=True)

        def of_segment(target: FitSegment) -> tuple[FloatArray, FloatArray]:
            return self._products(target, centers, group.ravel(), points, deviations)

        each = list(map_threads(of_segment, self.optimiser.segments, self.optimiser.context.jobs))
        matrices, scores = (sum(of_segments) / fit.normal.variance for of_segments in zip(*each, strict=True))
        matrices = (matrices[group.ravel()] + np.diag(1.0 / fit.free.prior_sd**2)) * np.outer(unit, unit)
        fixed = np.where(moves.is_moved, FIXED_PRECISION, 0.0)[:, :, None] * np.eye(len(fit.x))
        for damping in DAMPINGS:
            damped = matrices + fixed + damping * np.eye(len(fit.x))
            # not solved: where the motion grows from a point, the matrix may be singular in rounding
            yield unit * (np.linalg.pinv(damped, hermitian=True) @ (unit * scores)[:, :, None])[:, :, 0]

    def _products(
        self,
        target: FitSegment,
        centers: FloatArray,
        group: NDArray[np.intp],
        points: FloatArray,
        deviations: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Products of the sensitivities at centers [center, p, p], and of these with what points [n, p] lack.

        A point lacks a part of the change of the residual that its deviation would have at the estimates. Zero where
        the vehicle diverges.

        group: number [n] of the center of each point.
        """
        optimiser, fit = self.optimiser, self.fit
        inner, found = np.zeros((len(centers), len(fit.x), len(fit.x))), np.zeros(points.shape)
        with contextlib.suppress(DivergedError):
            expected = np.tensordot(deviations, optimiser.sensitivities(target, fit.x).converged()[1:], 1)
            series, diverged = optimiser.simulate(target, np.vstack([fit.x, points]))
            lacking = expected + target.without_initial_state(series[0] - series[1:])
            is_known = (diverged[1:] < 0) & np.isfinite(lacking).all(axis=(1, 2))
            for k, center in enumerate(centers):
                with contextlib.suppress(DivergedError):  # the other centers are left
                    rows = optimiser.sensitivities(target, center).converged()[1:]
                    inner[k] = np.tensordot(rows, rows, ([1, 2], [1, 2]))
                    some = (group == k) & is_known
                    found[some] = np.tensordot(lacking[some], rows, ([1, 2], [1, 2]))
        return inner, found
