"""The next run: which one would separate the rival models of a loop, and what it says once it is measured.

Each rival predicts the run with the parameters that it has from the data before, which the run may correct by a linear
step within their covariance: with r the residual, S the sensitivities and C = L L' the covariance, the prediction
moves by S' L (L' S S' L + I)^-1 L' S r. The probability that the run decides is that of Vuong's test of what is left
being clear in favour of the true one of two rivals, over realisations of the noise and of the true parameters about
their estimates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from railui.arrays import FloatArray
from railui.campaign.comparison import compared_channels, comparison_filter, kernel_filter
from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.identification.estimation.initial_state import estimate_initial_state, estimate_phases
from railui.identification.estimation.noise_floor import noise_weights
from railui.identification.prediction import Predictor
from railui.parallel import map_threads
from railui.planning.noise_residuals import draw_noise_residuals
from railui.planning.planned_runs import PlannedRun, simulate_runs
from railui.planning.rivals import RivalModel
from railui.planning.vuong import vuong_statistic

DRAWS = 16  # of noise and parameters: a register of vehicles
DRAW_SEED = 29
DIFFERENCE = 0.01  # of a standard deviation, step of the differences
MIN_SD = 0.5  # of the statistic over realisations, against a chance agreement of few


@dataclass(frozen=True)
class Prospect:
    """Chance that a run separates the final model (rival 0) from another.

    Attributes
    ----------
    rival
        Number of the other model.
    probability
        Mean over both being true.
    z
        Expected statistic, the smaller of both cases.
    """

    rival: int
    probability: float
    z: float


@dataclass(frozen=True, eq=False)
class NextRun:
    """A run that may be made next with a set of sensors, and what it would separate."""

    run: PlannedRun
    sensors: tuple[str, ...]
    prospects: tuple[Prospect, ...]

    @property
    def probability(self) -> float:
        """Mean chance to separate the final model from each of the others."""
        return float(np.mean([p.probability for p in self.prospects])) if self.prospects else 0.0


@dataclass(frozen=True, eq=False)
class _Realisations:
    """One run with every rival as truth.

    measured: weighted channels [truth][draw, channel, n] with noise. predictions: of every rival. length: samples of a
    block of squared errors.
    """

    channels: tuple[str, ...]
    measured: Sequence[FloatArray]
    predictions: Sequence[_Prediction]
    length: int

    def prospects(self, sensors: Sequence[str], critical: float) -> tuple[Prospect, ...]:
        """Chances with a set of sensors, which alone correct the predictions; critical: that of the test."""
        rows = [self.channels.index(c) for c in sensors]

        def errors(truth: int, rival: int) -> FloatArray:
            """Squared errors [draw, block] of the prediction of a rival."""
            residuals = self.predictions[rival].residuals(self.measured[truth], rows)
            return np.asarray(_block_errors(residuals, self.length).sum(axis=1))

        found = []
        for j in range(1, len(self.predictions)):
            cases = [_chance(errors(i, i), errors(i, k), critical) for i, k in ((0, j), (j, 0))]
            usable = [c for c in cases if c is not None]
            if usable:
                chance = float(np.mean([p for p, _ in usable]))
                found.append(Prospect(j, chance, min(z for _, z in usable)))
        return tuple(found)


def _chance(true: FloatArray, other: FloatArray, critical: float) -> tuple[float, float] | None:
    """Probability that the test is clear for the true model, and its expected statistic; None where all diverge."""
    z = np.array([vuong_statistic(a, b) for a, b in zip(true, other, strict=True) if np.all(np.isfinite([a, b]))])
    if not z.size:
        return None
    sd = max(float(np.std(z)), MIN_SD)
    return float(special.ndtr((np.mean(z) - critical) / sd)), float(np.mean(z))


def next_runs(
    context: Context,
    rivals: Sequence[RivalModel],
    runs: Sequence[PlannedRun],
    sensors: Sequence[str],
    more: Sequence[str] = (),
) -> list[NextRun]:
    """Assess runs with the sensors of a campaign, and with each of further sensors, the best first.

    Parameters
    ----------
    rivals
        The final model first.
    more
        Sensors that may be added, whose noise is that of the context.
    """

    critical = context.settings.planning.critical_z

    def assess(run: PlannedRun) -> list[NextRun]:
        realised = _realise(context, rivals, run, [*sensors, *more])
        if realised is None:
            return []
        sets = [tuple(sensors), *((*sensors, c) for c in more)]
        return [NextRun(run, chosen, realised.prospects(chosen, critical)) for chosen in sets]

    found = [one for part in map_threads(assess, runs, context.jobs) for one in part]
    return sorted(found, key=lambda r: -r.probability)


def _realise(
    context: Context, rivals: Sequence[RivalModel], run: PlannedRun, channels: Sequence[str]
) -> _Realisations | None:
    """Simulate a run with every rival as truth and compare all predictions; None where a rival diverges."""
    model = rivals[0].model
    try:
        segment = simulate_runs(context.campaign, model, [run], channels).segments[0]
    except ValueError:
        return None
    quiet = context.in_background(1)
    weights = noise_weights(quiet, model, segment)
    predictions = [_predict(context, r, segment, weights) for r in rivals]
    if not all(np.all(np.isfinite(p.series)) for p in predictions):
        return None
    noise = _noise(quiet, rivals[0], segment, weights, predictions[0].series)
    measured = [_draw_truth(quiet, rival, segment, weights, i) + noise for i, rival in enumerate(rivals)]
    return _Realisations(tuple(segment.channels), measured, predictions, _block_samples(context, segment))


@dataclass(frozen=True, eq=False)
class _Prediction:
    """Prediction of a run by a rival: weighted channels [channel, n], and how its uncertain parameters move them.

    directions [k, channel, n]: sensitivities along the principal axes of the covariance, times their deviations. share:
    of the samples that counts as independent.
    """

    series: FloatArray
    directions: FloatArray
    share: float

    def residuals(self, measured: FloatArray, rows: Sequence[int]) -> FloatArray:
        """Residuals [draw, channel, n] of the channels `rows` after one linear step within the covariance."""
        residual = (measured - self.series)[:, rows]
        axes = self.directions[:, rows].reshape(len(self.directions), -1)
        flat = residual.reshape(len(residual), -1)
        normal = self.share * axes @ axes.T + np.eye(len(axes))
        step = np.linalg.solve(normal, self.share * axes @ flat.T)
        return np.asarray((flat - step.T @ axes).reshape(residual.shape))


def _predict(
    context: Context, rival: RivalModel, segment: Segment, weights: FloatArray, start: FloatArray | None = None
) -> _Prediction:
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
    return _Prediction(series[0], directions, context.settings.calibration.independent_sample_share)


def _draw_truth(context: Context, rival: RivalModel, segment: Segment, weights: FloatArray, index: int) -> FloatArray:
    """Weighted channels [draw, channel, n] of vehicles drawn about the estimates of a rival; NaN where one diverges."""
    rng = np.random.default_rng(np.random.SeedSequence([context.seed, DRAW_SEED, index]))
    model = rival.model
    drawn = rival.values() + rng.standard_normal((DRAWS, len(rival.paths))) @ rival.deviations.T
    rows = np.tile(model.row, (DRAWS, 1))
    columns = [model.columns[p] for p in rival.paths]
    rows[:, columns] = np.where(np.sign(drawn) == np.sign(rows[:, columns]), drawn, rows[:, columns])
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


def _block_samples(context: Context, segment: Segment) -> int:
    """Samples of a block of squared errors."""
    return max(round(context.settings.validation.error_block_duration / segment.dt), 1)


def _block_errors(residual: FloatArray, length: int) -> FloatArray:
    """Squared residuals [..., channel, block] summed over blocks of samples."""
    starts = np.arange(0, residual.shape[-1], length)
    return np.asarray(np.add.reduceat(residual**2, starts, axis=-1))


@dataclass(frozen=True)
class Decision:
    """Comparison of the final model with another on a measured run.

    Attributes
    ----------
    rival
        Number of the other model.
    z
        Vuong's statistic, positive for the final model.
    is_clear
        True where the test decides at the separation level.
    """

    rival: int
    z: float
    is_clear: bool


def decide(context: Context, rivals: Sequence[RivalModel], segments: Sequence[Segment]) -> list[Decision]:
    """Compare the final model with each other rival on measured segments, by Vuong's test."""
    quiet = context.in_background(1)
    blocks: list[list[FloatArray]] = [[] for _ in rivals]
    for segment in segments:
        weights = noise_weights(quiet, rivals[0].model, segment)
        rows = [segment.channels.index(c) for c in compared_channels(segment) if c in context.noise]
        measured = comparison_filter(context.campaign, segment, segment.measured(segment.channels)) * weights[:, None]
        length = _block_samples(context, segment)
        for rival, found in zip(rivals, blocks, strict=True):
            model = estimate_phases(quiet, rival.model, segment)
            start = estimate_initial_state(quiet, model, segment)
            prediction = _predict(quiet, replace(rival, model=model), segment, weights, start)
            found.append(_block_errors(prediction.residuals(measured[None], rows)[0], length).sum(axis=0))
    errors = [np.concatenate(found) for found in blocks]
    statistics = [vuong_statistic(errors[0], other) for other in errors[1:]]
    critical = context.settings.planning.critical_z
    return [Decision(j, z, abs(z) > critical) for j, z in enumerate(statistics, 1)]


__all__ = ["Decision", "NextRun", "Prospect", "decide", "next_runs"]
