"""A run that may be made, simulated with every rival as truth and predicted by every rival.

Each rival predicts the run with the parameters that it has from the data before, which the run may correct by a linear
step within their covariance: with r the residual, S the sensitivities and C = L L' the covariance, the prediction
moves by S' L d, d = (L' S S' L + I)^-1 L' S r. The squared errors of the corrected prediction and d'd, the distance to
the estimates, add up to r' (I + S' C S)^-1 r, the misfit of the predictive distribution: a rival that must leave its
estimates did not predict the run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import special

from railui.arrays import FloatArray
from railui.campaign.comparison import comparison_filter, kernel_filter
from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.identification.estimation.block_products import split_into_blocks
from railui.identification.estimation.noise_floor import noise_weights
from railui.identification.prediction import Predictor
from railui.planning.noise_residuals import draw_noise_residuals
from railui.planning.planned_runs import PlannedRun, simulate_runs
from railui.planning.rivals import RivalModel
from railui.planning.vuong import vuong_statistic
from railui.vehicle.model import Model

DRAWS = 16  # of noise and parameters: a register of vehicles
DRAW_SEED = 29
DIFFERENCE = 0.01  # of a standard deviation, step of the differences
MIN_SD = 0.5  # of the statistic over realisations, against a chance agreement of few


@dataclass(frozen=True, eq=False)
class Misfit:
    """Squared errors [block] of a corrected prediction, per independent sample, and its distance to the estimates."""

    errors: FloatArray
    distance: float

    def statistic(self, other: Misfit) -> float:
        """Return Vuong's statistic against another rival, positive where this one is better."""
        return vuong_statistic(self.errors, other.errors, (self.distance, other.distance))


@dataclass(frozen=True, eq=False)
class Prediction:
    """Prediction of a run by a rival: weighted channels [channel, n], and how its uncertain parameters move them.

    directions [k, channel, n]: sensitivities along the principal axes of the covariance, times their deviations. share:
    of the samples that counts as independent.
    """

    series: FloatArray
    directions: FloatArray
    share: float

    def products(self, measured: FloatArray, block: int) -> Products:
        """Return the inner products with measured channels [draw, channel, n], in blocks of samples."""
        axes, residuals = (
            split_into_blocks(rows, block).transpose(1, 2, 0, 3) for rows in (self.directions, measured - self.series)
        )  # [channel, block, row, sample]
        samples_first = residuals.transpose(0, 1, 3, 2)
        squares = np.einsum("cbdn,cbdn->cbd", residuals, residuals)
        return Products(axes @ axes.transpose(0, 1, 3, 2), axes @ samples_first, squares, self.share)


@dataclass(frozen=True, eq=False)
class Products:
    """Inner products of k directions and the residuals of a prediction, per channel and block.

    gram [channel, block, k, k], projections [channel, block, k, draw], squares [channel, block, draw].
    """

    gram: FloatArray
    projections: FloatArray
    squares: FloatArray
    share: float

    def misfits(self, rows: Sequence[int]) -> list[Misfit]:
        """Misfit of the channels `rows` in each draw, after one linear step within the covariance."""
        gram, projections = self.gram[rows].sum(axis=0), self.projections[rows].sum(axis=0)
        normal = self.share * gram.sum(axis=0) + np.eye(gram.shape[-1])
        step = np.linalg.solve(normal, self.share * projections.sum(axis=0))
        corrected = np.einsum("kd,bkd->bd", step, gram @ step - 2.0 * projections)
        errors = self.share * (self.squares[rows].sum(axis=0) + corrected)
        distances = np.sum(step**2, axis=0)
        return [Misfit(e, float(d)) for e, d in zip(errors.T, distances, strict=True)]


@dataclass(frozen=True, eq=False)
class RivalRun:
    """One run with every rival as truth.

    Attributes
    ----------
    channels
        Names of the sensors.
    measured
        Weighted channels with noise [draw, channel, n] of every truth.
    predictions
        Of every rival.
    without_effect
        Weighted channels [channel, n] that each rival predicts without the effect in which it differs; NaN where it
        diverges.
    block
        Samples of a block of squared errors.
    """

    channels: tuple[str, ...]
    measured: Sequence[FloatArray]
    predictions: Sequence[Prediction]
    without_effect: Sequence[FloatArray]
    block: int

    @cached_property
    def _products(self) -> list[list[Products]]:
        """Of every truth with every prediction."""
        return [[p.products(measured, self.block) for p in self.predictions] for measured in self.measured]

    def statistics(self, sensors: Sequence[str], critical: float) -> tuple[FloatArray, FloatArray]:
        """Return the chance that each true rival [i, j] is clear of each other, and the expected statistic [i, j].

        Parameters
        ----------
        sensors
            Which alone correct the predictions.
        critical
            Value of Vuong's statistic above which the test is clear.
        """
        rows = [self.channels.index(c) for c in sensors]
        misfits = [[products.misfits(rows) for products in of_truth] for of_truth in self._products]
        n = len(self.predictions)
        chance, mean = np.full((n, n), np.nan), np.full((n, n), np.nan)
        for i in range(n):
            for j in range(n):
                if i != j:
                    chance[i, j], mean[i, j] = _chance(misfits[i][i], misfits[i][j], critical)
        return chance, mean

    def differences(self) -> FloatArray:
        """Difference of the motions that two rivals predict [i, j], as a share of what their effects change.

        Root of the ratio of squares of the weighted channels, without noise, each after the linear step of the rival
        that is compared; 1 and more for a model that lacks the effect.
        """
        rows = range(len(self.channels))

        def square(truth: FloatArray, prediction: Prediction) -> float:
            (misfit,) = prediction.products(truth[None], self.block).misfits(rows)
            return float(np.sum(misfit.errors))

        changes = [
            square(p.series, Prediction(bare, p.directions, p.share))
            for p, bare in zip(self.predictions, self.without_effect, strict=True)
        ]
        n = len(self.predictions)
        found = np.zeros((n, n))
        for i in range(n):
            for j in range(i):
                change = float(np.fmax(changes[i], changes[j]))
                apart = max(square(self.predictions[a].series, self.predictions[b]) for a, b in ((i, j), (j, i)))
                found[i, j] = found[j, i] = np.sqrt(apart / change) if change > 0.0 else np.inf
        return found


def _chance(true: Sequence[Misfit], other: Sequence[Misfit], critical: float) -> tuple[float, float]:
    """Probability that the test is clear for the true model, and its expected statistic; NaN where all diverge."""
    found = np.array([a.statistic(b) for a, b in zip(true, other, strict=True)])
    z = found[np.isfinite(found)]
    if not z.size:
        return np.nan, np.nan
    sd = max(float(np.std(z)), MIN_SD)
    return float(special.ndtr((np.mean(z) - critical) / sd)), float(np.mean(z))


def simulate_rivals(
    context: Context, rivals: Sequence[RivalModel], run: PlannedRun, channels: Sequence[str]
) -> RivalRun | None:
    """Simulate a run with every rival as truth and predict it by every rival; None where one diverges."""
    rivals = [r.in_load_state(run.load) for r in rivals]
    model = rivals[0].model
    try:
        segment = simulate_runs(context.campaign, model, [run], channels).segments[0]
    except ValueError:
        return None
    quiet = context.in_background(1)
    weights = noise_weights(quiet, model, segment)
    predictions = [predict(context, r, segment, weights) for r in rivals]
    if not all(np.all(np.isfinite(p.series)) for p in predictions):
        return None
    bare = [_simulate(context, r.without_effect(), segment, weights) for r in rivals]
    noise = _noise(quiet, rivals[0], segment, weights, predictions[0].series)
    measured = [_draw_truth(quiet, rival, segment, weights, i) + noise for i, rival in enumerate(rivals)]
    return RivalRun(tuple(segment.channels), measured, predictions, bare, block_samples(context, segment))


def predict(
    context: Context, rival: RivalModel, segment: Segment, weights: FloatArray, start: FloatArray | None = None
) -> Prediction:
    """Predict a run by a rival from an initial state, at rest by default; NaN where it diverges."""
    axes = rival.deviations
    columns = [rival.model.columns[p] for p in rival.paths]
    model = rival.model.on_segment(*segment.segment_key)
    rows = np.tile(model.row, (1 + axes.shape[1], 1))
    rows[1:, columns] += DIFFERENCE * axes.T
    filter_ = kernel_filter(context.campaign, segment, weights)
    predictor = Predictor(model, segment, initial_state=start, filter=filter_)
    series, diverged = predictor.simulate(batch=model.batch(rows))
    series = np.array(series)
    if diverged[0] >= 0:
        series[0] = np.nan
    directions = np.where((diverged[1:] < 0)[:, None, None], (series[1:] - series[0]) / DIFFERENCE, 0.0)
    return Prediction(series[0], directions, context.settings.calibration.independent_sample_share)


def _simulate(context: Context, model: Model, segment: Segment, weights: FloatArray) -> FloatArray:
    """Weighted channels [channel, n] of a vehicle; NaN where it diverges."""
    predictor = Predictor(model, segment, filter=kernel_filter(context.campaign, segment, weights))
    series, diverged = predictor.simulate()
    return np.full_like(series[0], np.nan) if diverged[0] >= 0 else np.asarray(series[0])


def _draw_truth(context: Context, rival: RivalModel, segment: Segment, weights: FloatArray, index: int) -> FloatArray:
    """Weighted channels [draw, channel, n] of vehicles drawn about the estimates of a rival; NaN where one diverges."""
    rng = np.random.default_rng(np.random.SeedSequence([context.seed, DRAW_SEED, index]))
    model = rival.model
    rows = np.tile(model.row, (DRAWS, 1))
    rows[:, [model.columns[p] for p in rival.paths]] = rival.draw(rng, DRAWS)
    filter_ = kernel_filter(context.campaign, segment, weights)
    predictor = Predictor(model, segment, filter=filter_)
    series, diverged = predictor.simulate(batch=model.batch(rows))
    series = np.array(series)
    series[diverged >= 0] = np.nan
    return series


def _noise(context: Context, rival: RivalModel, segment: Segment, weights: FloatArray, clean: FloatArray) -> FloatArray:
    """Weighted noise [draw, channel, n] of the sensors, and of the track through the final model."""
    campaign = context.campaign
    predictor = Predictor(rival.model, segment, filter=kernel_filter(campaign, segment, weights))
    seeds = [(context.seed, DRAW_SEED, k, 1) for k in range(DRAWS)]

    def filter_and_weight(x: FloatArray) -> FloatArray:
        return comparison_filter(campaign, segment, x) * weights[:, None]

    return draw_noise_residuals(context, predictor, clean, filter_and_weight, seeds)


def block_samples(context: Context, segment: Segment) -> int:
    """Samples of a block of squared errors."""
    return max(round(context.settings.validation.error_block_duration / segment.dt), 1)
