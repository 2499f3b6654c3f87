"""Noise floor: the error that sensor noise and track noise leave where the model is true, and the weights from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.comparison import (
    Comparison,
    compared_channels,
    comparison_filter,
    kernel_filter,
    nrmse,
    overall_nrmse,
    segment_filter,
)
from railui.campaign.noise.model import NoiseModel
from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.identification.estimation.initial_state import estimate_initial_state, estimate_phases
from railui.identification.estimation.validation import without_start
from railui.identification.prediction import Predictor, SimulationError, required_steps
from railui.parallel import map_threads
from railui.vehicle.model import Model

WEIGHT_SEED = 7  # of first runs also the draw 7 of a floor: weights take a mean over draws, and lose nothing by it
INTERVAL_SEED = 8
INTERVAL_DRAWS = 4000
MIN_VARIANCE_SHARE = 1e-6  # of a channel's variance: least noise that its weight counts with


@dataclass(frozen=True)
class NoiseFloor:
    """NRMSE expected from noise alone: mean and spread over realisations, per channel, and sensors only.

    Attributes
    ----------
    interval
        5th and 95th percentile, from the uncertainty of the noise levels and the spread over realisations.
    source
        Source of the noise levels: stated, estimated or both.
    """

    nrmse: float
    sd: float
    channels: Mapping[str, float]
    sensors_only: float
    interval: tuple[float, float] = (float("nan"), float("nan"))
    source: str = "stated"


class SimulatedTruth:
    """A model taken as true on a segment, for noise realisations of its measurement and its prediction."""

    def __init__(self, context: Context, model: Model, segment: Segment, index: int) -> None:
        self.context = context
        self.segment = segment
        self.index = index
        self.channels = compared_channels(segment)
        self.clean: FloatArray | None = None  # where the model diverges, or is too stiff at the speed of the segment
        try:
            truth = estimate_phases(context, model, segment)
            start = estimate_initial_state(context, truth, segment)
            self.predictor = Predictor(truth, segment, initial_state=start)
            self.clean = self._compared(*self.predictor.simulate(self.channels))
            self.measured = comparison_filter(context.campaign, segment, segment.measured(self.channels))
        except SimulationError as error:
            context.progress.message(f"no noise floor on {segment.file}: {error}")

    def draw(self, seed: int) -> tuple[FloatArray, FloatArray] | None:
        """Draw the measurement with sensor noise and the prediction on a track with noise, both as compared.

        None where the model cannot be simulated, or diverges.
        """
        if self.clean is None:
            return None
        campaign, segment = self.context.campaign, self.segment
        rng = np.random.default_rng(np.random.SeedSequence([seed, self.index]))
        wheelset_spacing = self.predictor.model.wheelset_spacing()
        table = segment.noisy_table(
            self.context.noise, campaign.noise_band, rng, wheelset_spacing, self.predictor.steps
        )
        simulated = self._compared(*self.predictor.simulate(self.channels, table=table))
        if simulated is None:
            return None
        drawn = self.context.noise.draw(self.channels, segment.samples, segment.dt, rng)
        return self.clean + comparison_filter(campaign, segment, drawn), simulated

    def comparisons(
        self, drawn: FloatArray, simulated: FloatArray, is_after_start: bool = False
    ) -> tuple[Comparison, Comparison]:
        """Compare a drawn measurement with the prediction on a track with noise, and with that on the true track.

        Errors relate to the motion that was measured, as those of the model do.
        """
        clean = np.full_like(drawn, np.nan) if self.clean is None else self.clean
        series = [self.measured - (drawn - x) for x in (simulated, clean)]
        names, dt = tuple(self.channels), self.segment.dt
        both, sensors = (Comparison(names, self.measured, x, dt) for x in series)
        if not is_after_start:
            return both, sensors
        return without_start(self.context, self.segment, both), without_start(self.context, self.segment, sensors)

    def _compared(self, series: FloatArray, diverged: NDArray[np.int64]) -> FloatArray | None:
        return None if diverged[0] >= 0 else comparison_filter(self.context.campaign, self.segment, series[0])


def estimate_noise_floor(
    context: Context,
    model: Model,
    segments: Sequence[Segment],
    draws: int | None = None,
    *,
    is_after_start: bool = False,
) -> NoiseFloor:
    """Estimate the noise floor: simulate the model as truth on noisy track and add sensor noise.

    Realisations on which the model diverges are left out; NaN where all are.

    Parameters
    ----------
    draws
        Noise realisations; those of the settings by default.
    is_after_start
        Whether the start of every segment, on which its initial state is estimated, is left out.
    """
    draws = context.settings.validation.noise_floor_draws if draws is None else draws
    truths = list(
        map_threads(lambda i: SimulatedTruth(context, model, segments[i], i), range(len(segments)), context.jobs)
    )
    tasks = list(product(range(draws), truths))
    drawn = list(map_threads(lambda task: task[1].draw(task[0]), tasks, context.jobs))
    both: list[list[Comparison]] = []
    sensors: list[list[Comparison]] = []
    for k in range(draws):
        realisation = list(zip(truths, drawn[k * len(truths) : (k + 1) * len(truths)], strict=True))
        compared = [t.comparisons(*pair, is_after_start) for t, pair in realisation if pair is not None]
        if len(compared) == len(truths):
            both.append([c for c, _ in compared])
            sensors.append([c for _, c in compared])
    if len(both) < draws:
        context.progress.message(f"the model diverges in {draws - len(both)} of {draws} realisations of the noise")
    if not both:
        names = dict.fromkeys(c for t in truths for c in t.channels)
        return NoiseFloor(np.nan, np.nan, dict.fromkeys(names, np.nan), np.nan, source=context.noise.source)
    channels = [nrmse(comparisons) for comparisons in both]
    totals = [overall_nrmse(c) for c in channels]
    spread = float(np.std(totals, ddof=1)) if len(totals) > 1 else float("nan")
    sensor_channels = [nrmse(comparisons) for comparisons in sensors]
    inputs = list(dict.fromkeys(c for s in segments for c in s.input_columns))
    return NoiseFloor(
        float(np.mean(totals)),
        spread,
        {c: float(np.mean([e[c] for e in channels])) for c in channels[0]},
        float(np.mean([overall_nrmse(c) for c in sensor_channels])),
        _interval(context.noise, inputs, channels, sensor_channels, spread, len(totals)),
        context.noise.source,
    )


def _interval(
    noise: NoiseModel,
    inputs: Sequence[str],
    both: Sequence[Mapping[str, float]],
    sensors: Sequence[Mapping[str, float]],
    sd: float,
    draws: int,
) -> tuple[float, float]:
    """5th and 95th percentile of the noise floor over log-normal noise levels and realisations of it.

    The level of every sensor is uncertain by itself, that of the input columns by one factor. A further realisation has
    Student's distribution about the mean of a number of draws with their standard deviation.
    """
    names = list(both[0])
    total = np.array([np.mean([e[c] ** 2 for e in both]) for c in names])
    own = np.minimum([np.mean([e[c] ** 2 for e in sensors]) for c in names], total)
    rng = np.random.default_rng(np.random.SeedSequence([INTERVAL_SEED]))
    log_sd = np.array([noise.log_sd(c) for c in names])
    levels = np.exp(2.0 * log_sd * rng.standard_normal((INTERVAL_DRAWS, len(names))))
    log_sd_of_inputs = max(map(noise.log_sd, inputs), default=0.0)
    track = np.exp(2.0 * log_sd_of_inputs * rng.standard_normal((INTERVAL_DRAWS, 1)))
    realisation = sd * np.sqrt(1.0 + 1.0 / draws) * rng.standard_t(max(draws - 1, 1), INTERVAL_DRAWS)
    drawn = np.sqrt(np.mean(own * levels + (total - own) * track, axis=1)) + realisation
    low, high = np.nanpercentile(np.maximum(drawn, 0.0), [5.0, 95.0])
    return float(low), float(high)


def sensor_noise_error(context: Context, segments: Sequence[Segment]) -> float:
    """NRMSE that noise of the sensors alone leaves on segments, by its expectation."""
    return overall_nrmse(sensor_noise_errors(context, segments))


def sensor_noise_errors(context: Context, segments: Sequence[Segment]) -> dict[str, float]:
    """NRMSE of each channel that noise of the sensors alone leaves on segments, by its expectation."""
    campaign, noise = context.campaign, context.noise
    variance, power = dict[str, float](), dict[str, float]()
    for s in segments:
        names = compared_channels(s)
        expected = noise.variance(names, segment_filter(campaign, s), s.dt)
        measured = np.mean(comparison_filter(campaign, s, s.measured(names)) ** 2, axis=1)
        for c, own, total in zip(names, expected, measured, strict=True):
            variance[c] = variance.get(c, 0.0) + s.samples * float(own)
            power[c] = power.get(c, 0.0) + s.samples * float(total)
    return {c: float(np.sqrt(variance[c] / max(power[c], 1e-300))) for c in power}


def noise_weights(context: Context, model: Model, segment: Segment) -> FloatArray:
    """Weight of each channel [channel]: 1 / standard deviation that sensor and track noise leave in the band."""
    [variance] = noise_variances(context, model, [segment], [None])
    return np.asarray(1.0 / np.sqrt(variance))


def noise_variances(
    context: Context, model: Model, windows: Sequence[Segment], initial_states: Sequence[FloatArray | None]
) -> list[FloatArray]:
    """Variance of each channel [channel] that sensor and track noise leave in the band of every window.

    Parameters
    ----------
    windows
        Windows of one segment, or the segment alone: they have the same noise of the track.
    initial_states
        Those of a hunting vehicle, whose motions from rest would grow apart; None: at rest.
    """
    noise, campaign = context.noise, context.campaign
    whole = windows[0].window_of or windows[0]
    channels, spacing = whole.channels, model.wheelset_spacing()
    rng = np.random.default_rng(np.random.SeedSequence([WEIGHT_SEED, whole.number, whole.run_index]))
    flat = [kernel_filter(campaign, w, np.ones(len(channels))) for w in windows]
    steps = max(required_steps(model, w) for w in windows)
    predictors = [
        Predictor(model, w, steps, start, kernel)
        for w, start, kernel in zip(windows, initial_states, flat, strict=True)
    ]
    clean = [predictor.simulate() for predictor in predictors]

    def variances_by_track(drawn: Mapping[str, FloatArray]) -> list[FloatArray | None]:
        table = whole.table_with_noise(drawn, spacing, steps)
        tables = [table if w is whole else w.window_rows(table, steps) for w in windows]
        noisy = [p.simulate(table=rows) for p, rows in zip(predictors, tables, strict=True)]
        return [
            np.var(x.series[0] - y.series[0], axis=1) if x.diverged[0] < 0 and y.diverged[0] < 0 else None
            for x, y in zip(noisy, clean, strict=True)
        ]

    count = context.settings.validation.noise_weight_draws
    draws = [whole.draw_input_noise(noise, campaign.noise_band, rng) for _ in range(count)]
    by_track = list(map_threads(variances_by_track, draws, context.jobs))
    found = []
    for w, of_window in zip(windows, zip(*by_track, strict=True), strict=True):
        variance = noise.variance(channels, segment_filter(campaign, w), w.dt)
        known = [x for x in of_window if x is not None]
        if known:
            variance = variance + np.mean(known, axis=0)
        measured = comparison_filter(campaign, w, w.measured(channels)).var(axis=1)
        found.append(np.asarray(np.maximum(variance, MIN_VARIANCE_SHARE * measured + 1e-300)))
    return found
