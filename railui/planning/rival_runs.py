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
from railui.campaign.comparison import kernel_filter
from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.identification.estimation.block_products import split_into_blocks
from railui.identification.estimation.noise_floor import noise_weights
from railui.identification.prediction import Predictor
from railui.planning.noise_residuals import SensorNoise, draw_responses_to_input_noise
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
    of the samples that counts as independent. block: samples of a block of inner products.
    """

    series: FloatArray
    directions: FloatArray
    share: float
    block: int

    def _axes(self) -> FloatArray:
        """Directions [channel, block, k, sample]; not retained, since they are as large as the directions."""
        return split_into_blocks(self.directions, self.block).transpose(1, 2, 0, 3)

    @cached_property
    def _gram(self) -> FloatArray:
        """Inner products of the directions [channel, block, k, k]."""
        axes = self._axes()
        return np.asarray(axes @ axes.transpose(0, 1, 3, 2))

    def products(self, measured: FloatArray) -> Products:
        """Return the inner products with the residuals of measured channels [draw, channel, n]."""
        return self.products_of_residuals(measured - self.series)

    def products_of_residuals(self, residuals: FloatArray) -> Products:
        """Return the inner products with residuals [draw, channel, n]."""
        in_blocks = split_into_blocks(residuals, self.block).transpose(1, 2, 0, 3)
        squares = np.einsum("cbdn,cbdn->cbd", in_blocks, in_blocks)
        return Products(self._gram, self._axes() @ in_blocks.transpose(0, 1, 3, 2), squares, self.share)


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
class RivalPredictions:
    """One run as every rival predicts it, without noise.

    Attributes
    ----------
    channels
        Names of the sensors.
    predictions
        Of every rival.
    without_effect
        Weighted channels [channel, n] that each rival predicts without the effect in which it differs; NaN where it
        diverges.
    """

    channels: tuple[str, ...]
    predictions: Sequence[Prediction]
    without_effect: Sequence[FloatArray]

    @cached_property
    def squares(self) -> FloatArray:
        """Squared difference of the weighted channels of two rivals [i, j], after the linear step of either."""
        n = len(self.predictions)
        found = np.zeros((n, n))
        for i in range(n):
            for j in range(i):
                apart = self.predictions[i].series - self.predictions[j].series
                found[i, j] = found[j, i] = max(self._square(apart, j), self._square(apart, i))
        return found

    @cached_property
    def differences(self) -> FloatArray:
        """Difference of the motions that two rivals predict [i, j], as a share of what their effects change.

        Root of the ratio of squares; 1 and more for a model that lacks the effect.
        """
        series = (p.series - bare for p, bare in zip(self.predictions, self.without_effect, strict=True))
        changes = np.array([self._square(change, i) for i, change in enumerate(series)])
        larger = np.fmax(changes[:, None], changes)
        relative = np.sqrt(self.squares / np.where(larger > 0.0, larger, np.nan))
        found = np.where(larger > 0.0, relative, np.inf)
        np.fill_diagonal(found, 0.0)
        return found

    def _square(self, residual: FloatArray, i: int) -> float:
        (misfit,) = self.predictions[i].products_of_residuals(residual[None]).misfits(range(len(self.channels)))
        return float(np.sum(misfit.errors))


@dataclass(frozen=True, eq=False)
class RivalRun:
    """One run with every rival as truth.

    Attributes
    ----------
    predicted
        By every rival.
    measured
        Weighted channels with noise [draw, channel, n] of every truth.
    """

    predicted: RivalPredictions
    measured: Sequence[FloatArray]

    @cached_property
    def _products(self) -> list[list[Products]]:
        """Of every truth with every prediction."""
        return [[p.products(measured) for p in self.predicted.predictions] for measured in self.measured]

    def statistics(self, sensors: Sequence[str], critical: float) -> tuple[FloatArray, FloatArray]:
        """Return the chance that each true rival [i, j] is clear of each other, and the expected statistic [i, j].

        Parameters
        ----------
        sensors
            Which alone correct the predictions.
        critical
            Value of Vuong's statistic above which the test is clear.
        """
        rows = [self.predicted.channels.index(c) for c in sensors]
        misfits = [[products.misfits(rows) for products in of_truth] for of_truth in self._products]
        n = len(misfits)
        chance, mean = np.full((n, n), np.nan), np.full((n, n), np.nan)
        for i in range(n):
            for j in range(n):
                if i != j:
                    chance[i, j], mean[i, j] = _chance(misfits[i][i], misfits[i][j], critical)
        return chance, mean


def _chance(true: Sequence[Misfit], other: Sequence[Misfit], critical: float) -> tuple[float, float]:
    """Probability that the test is clear for the true model, and its expected statistic; NaN where all diverge."""
    found = np.array([a.statistic(b) for a, b in zip(true, other, strict=True)])
    z = found[np.isfinite(found)]
    if not z.size:
        return np.nan, np.nan
    sd = max(float(np.std(z)), MIN_SD)
    return float(special.ndtr((np.mean(z) - critical) / sd)), float(np.mean(z))


@dataclass(frozen=True, eq=False)
class PredictedRun:
    """A run that may be made, as every rival predicts it: its segment, and the weights of the channels."""

    run: PlannedRun
    rivals: Sequence[RivalModel]
    segment: Segment
    weights: FloatArray
    predicted: RivalPredictions

    def with_noise(self, context: Context, sensor_noise: SensorNoise) -> RivalRun:
        """Simulate the run with every rival as truth."""
        quiet, segment, weights = context.in_background(1), self.segment, self.weights
        noise = sensor_noise.filtered(segment) * weights[:, None]
        clean = self.predicted.predictions[0].series
        noise -= _responses_to_track_noise(quiet, self.rivals[0], segment, weights, clean)
        truths = [_draw_truth(quiet, rival, segment, weights, i) + noise for i, rival in enumerate(self.rivals)]
        return RivalRun(self.predicted, truths)


def predict_run(
    context: Context, rivals: Sequence[RivalModel], run: PlannedRun, channels: Sequence[str]
) -> PredictedRun | None:
    """Predict a run by every rival; None where one diverges."""
    rivals = [r.in_load_state(run.load) for r in rivals]
    model = rivals[0].model
    try:
        segment = simulate_runs(context.campaign, model, [run], channels).segments[0]
    except ValueError:
        return None
    weights = noise_weights(context.in_background(1), model, segment)
    predictions = [predict(context, r, segment, weights) for r in rivals]
    if not all(np.all(np.isfinite(p.series)) for p in predictions):
        return None
    bare = [_simulate(context, r.without_effect(), segment, weights) for r in rivals]
    predicted = RivalPredictions(tuple(segment.channels), predictions, bare)
    return PredictedRun(run, rivals, segment, weights, predicted)


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
    share = context.settings.calibration.independent_sample_share
    return Prediction(series[0], directions, share, block_samples(context, segment.dt))


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


def draw_seeds(context: Context, stream: int) -> list[tuple[int, ...]]:
    """Seeds of the draws of noise."""
    return [(context.seed, DRAW_SEED, k, stream) for k in range(DRAWS)]


def _responses_to_track_noise(
    context: Context, rival: RivalModel, segment: Segment, weights: FloatArray, clean: FloatArray
) -> FloatArray:
    """Weighted changes [draw, channel, n] of a rival's prediction by noise of the track."""
    predictor = Predictor(rival.model, segment, filter=kernel_filter(context.campaign, segment, weights))
    return draw_responses_to_input_noise(context, predictor, clean, draw_seeds(context, 1))


def block_samples(context: Context, dt: float) -> int:
    """Samples of a block of squared errors."""
    return max(round(context.settings.validation.error_block_duration / dt), 1)
