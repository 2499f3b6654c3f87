"""Noise floor: the error that sensor noise and track noise leave where the model is true, and the weights from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.comparison import (
    Comparison,
    compared_channels,
    comparison_filter,
    cut_samples,
    kernel_filter,
    nrmse,
    overall_nrmse,
)
from railui.campaign.dataset import Segment
from railui.identification.context import Context
from railui.identification.estimation.initial_state import estimate_initial_state, estimate_phases
from railui.identification.prediction import Predictor
from railui.parallel import map_threads
from railui.vehicle.model import Model

WHITE_SAMPLES = 4000  # at least, to measure how much white noise the comparison filter passes
WEIGHT_SEED = 7
MIN_VARIANCE_SHARE = 1e-6  # of a channel's variance: least noise that its weight counts with


@dataclass(frozen=True)
class NoiseFloor:
    """NRMSE expected from the stated noise alone: mean and spread over realisations, per channel, and sensors only."""

    nrmse: float
    sd: float
    channels: Mapping[str, float]
    sensors_only: float


class _SimulatedTruth:
    """A model taken as true on a segment, for noise realisations of its measurement and its prediction."""

    def __init__(self, context: Context, model: Model, segment: Segment, index: int) -> None:
        self.context = context
        self.segment = segment
        self.index = index
        self.channels = compared_channels(segment)
        truth = estimate_phases(context, model, segment)
        start = estimate_initial_state(context, truth, segment)
        self.predictor = Predictor(truth, segment, initial_state=start)
        series, _ = self.predictor.simulate(self.channels)
        self.clean = comparison_filter(context.campaign, segment, series[0])
        self.sd = np.array([context.noise.get(c, 0.0) for c in self.channels])

    def draw(self, seed: int) -> tuple[FloatArray, FloatArray]:
        """Draw the measurement with sensor noise and the prediction on a track with noise, both as compared."""
        campaign, segment = self.context.campaign, self.segment
        rng = np.random.default_rng(np.random.SeedSequence([seed, self.index]))
        wheelset_spacing = self.predictor.model.wheelset_spacing()
        table = segment.noisy_table(
            self.context.noise, campaign.noise_band, rng, wheelset_spacing, self.predictor.steps
        )
        series, _ = self.predictor.simulate(self.channels, table=table)
        white = comparison_filter(campaign, segment, self.sd[:, None] * rng.standard_normal(series[0].shape))
        return self.clean + white, comparison_filter(campaign, segment, series[0])


def estimate_noise_floor(
    context: Context, model: Model, segments: Sequence[Segment], draws: int | None = None
) -> NoiseFloor:
    """Estimate the noise floor: simulate the model as truth on noisy track and add sensor noise.

    draws: noise realisations; those of the settings by default.
    """
    draws = context.settings.validation.noise_floor_draws if draws is None else draws
    both: list[list[Comparison]] = [[] for _ in range(draws)]
    sensors: list[list[Comparison]] = [[] for _ in range(draws)]
    for index, segment in enumerate(segments):
        truth = _SimulatedTruth(context, model, segment, index)
        names = tuple(truth.channels)
        for seed, (measured, simulated) in enumerate(map_threads(truth.draw, range(draws), context.jobs)):
            both[seed].append(Comparison(names, measured, simulated, segment.dt))
            sensors[seed].append(Comparison(names, measured, truth.clean, segment.dt))
    channels = [nrmse(comparisons) for comparisons in both]
    totals = [overall_nrmse(c) for c in channels]
    return NoiseFloor(
        float(np.mean(totals)),
        float(np.std(totals)),
        {c: float(np.mean([e[c] for e in channels])) for c in channels[0]},
        float(np.mean([overall_nrmse(nrmse(comparisons)) for comparisons in sensors])),
    )


def noise_weights(context: Context, model: Model, segment: Segment) -> FloatArray:
    """Weight of each channel [channel]: 1 / standard deviation that sensor and track noise leave in the band."""
    channels, noise, campaign = segment.channels, context.noise, context.campaign
    draws = context.settings.validation.noise_weight_draws
    sd = np.array([noise.get(c, 0.0) for c in channels])
    rng = np.random.default_rng(np.random.SeedSequence([WEIGHT_SEED, segment.number, segment.run_index]))
    enough = min(segment.samples, max(WHITE_SAMPLES, 4 * cut_samples(campaign, segment)))
    white = comparison_filter(campaign, segment, rng.standard_normal((1, enough)))
    variance = (sd * white.std()) ** 2
    flat = kernel_filter(campaign, segment, np.ones(len(channels)))
    predictor = Predictor(model, segment, filter=flat)
    clean, diverged = predictor.simulate()
    if diverged[0] < 0:
        for _ in range(draws):
            table = segment.noisy_table(noise, campaign.noise_band, rng, model.wheelset_spacing(), predictor.steps)
            noisy, _ = predictor.simulate(table=table)
            variance = variance + np.var(noisy[0] - clean[0], axis=1) / draws
    measured = comparison_filter(campaign, segment, segment.measured(channels)).var(axis=1)
    return np.asarray(1.0 / np.sqrt(np.maximum(variance, MIN_VARIANCE_SHARE * measured + 1e-300)))
