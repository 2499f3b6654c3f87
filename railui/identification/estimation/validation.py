"""A model judged on runs: error per channel as the loop report defines it, and the noise floor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.dataset import (
    COMPARED,
    RIG_RESPONSES,
    Dataset,
    Segment,
    comparison_filter,
    cut_samples,
    kernel_filter,
    nrmse,
    overall_nrmse,
    simulate,
    steps_for,
)
from railui.identification.estimation.initial_state import estimate_initial_state, estimate_phases
from railui.parallel import map_threads
from railui.vehicle.model import Model

BLOCK = 2.0  # seconds of a block of squared error


@dataclass(frozen=True)
class Validation:
    """nrmse per channel and overall (NaN where diverged), the series simulated per stretch, where it diverged."""

    channels: Mapping[str, float]
    nrmse: float
    series: tuple[FloatArray, ...]
    diverged: tuple[tuple[str, float], ...]
    block_errors: FloatArray = field(default_factory=lambda: np.zeros(0))  # what each block of time adds to nrmse^2

    def error_reduction(self, other: Validation) -> tuple[float, float]:
        """Share of this squared error that another judgement of the same runs is free of, and its standard error."""
        if not np.isfinite(self.nrmse) or not np.isfinite(other.nrmse):
            return (1.0 if np.isfinite(other.nrmse) else -np.inf), 0.0
        less = (self.block_errors - other.block_errors) / self.block_errors.sum()
        return float(less.sum()), float(np.sqrt(len(less)) * less.std())


def compared_channels(stretch: Segment) -> list[str]:
    """The channels that count in nrmse."""
    return [c for c in stretch.channels if c in COMPARED or c in RIG_RESPONSES]


def validate(model: Model, measurement: Dataset, stretches: Sequence[Segment]) -> Validation:
    """The error of a model on stretches: initial states estimated on each, nothing else."""
    return validate_each([(model, stretch) for stretch in stretches], measurement)


def validate_each(placed: Sequence[tuple[Model, Segment]], measurement: Dataset) -> Validation:
    """The error of models, each on a stretch of its own."""
    pairs, series, lost = [], [], []
    for vehicle, stretch in placed:
        model = estimate_phases(vehicle, stretch, measurement.noise)
        start = estimate_initial_state(model, stretch, measurement.noise)
        channels = stretch.channels
        z, diverged = simulate(model, stretch, channels, initial=start)
        z = z[0]
        if diverged[0] >= 0:
            lost.append((stretch.file, float(stretch.columns["t"][diverged[0]])))
            z = np.full_like(z, np.nan)
        series.append(z)
        used = [i for i, c in enumerate(channels) if c in compared_channels(stretch)]
        x = comparison_filter(measurement.campaign, stretch, stretch.measured(channels)[used])
        y = comparison_filter(measurement.campaign, stretch, z[used]) if diverged[0] < 0 else np.full_like(x, np.nan)
        pairs.append(([channels[i] for i in used], x, y, stretch.dt))
    return compute_validation(pairs, series, lost)


Pair = tuple[Sequence[str], FloatArray, FloatArray, float]


def compute_validation(
    pairs: Sequence[Pair], series: Sequence[FloatArray], lost: Sequence[tuple[str, float]]
) -> Validation:
    """The judgement of stretches: channels, measured and simulated [channel, n] as compared, dt [s] of each."""
    errors = nrmse([pair[:3] for pair in pairs])
    power: dict[str, float] = {}
    for channels, x, _, _ in pairs:
        for c, row in zip(channels, x, strict=True):
            power[c] = power.get(c, 0.0) + float(np.sum(row**2))
    squares = []
    for channels, x, z, dt in pairs:
        weight = np.array([1.0 / max(power[c], 1e-300) for c in channels]) / len(power)
        each = weight @ (x - z) ** 2
        edges = np.arange(
            0, len(each), max(1, round(BLOCK / dt)) if len(each) * dt > 4 * BLOCK else len(each) // 20 + 1
        )
        squares.append(np.add.reduceat(each, edges))
    return Validation(errors, overall_nrmse(errors), tuple(series), tuple(lost), np.concatenate(squares))


@dataclass(frozen=True)
class NoiseFloor:
    """The nrmse expected from the stated noise alone: mean and spread over the seeds, per channel, and sensors only."""

    nrmse: float
    sd: float
    channels: Mapping[str, float]
    sensors_only: float


Compared = tuple[Sequence[str], FloatArray, FloatArray]


class _SimulatedTruth:
    """A model taken as true on a stretch, which is measured and simulated again with noise."""

    def __init__(self, model: Model, measurement: Dataset, stretch: Segment, index: int) -> None:
        self.model, self.measurement = estimate_phases(model, stretch, measurement.noise), measurement
        self.stretch, self.index, model = stretch, index, self.model
        self.channels, self.steps = compared_channels(stretch), steps_for(model, stretch)
        self.start = estimate_initial_state(model, stretch, measurement.noise)
        truth = simulate(model, stretch, self.channels, steps=self.steps, initial=self.start)[0][0]
        self.clean = comparison_filter(measurement.campaign, stretch, truth)
        self.sd = np.array([measurement.noise.get(c, 0.0) for c in self.channels])

    def drawn(self, seed: int) -> tuple[FloatArray, FloatArray]:
        """Measured with noise of the sensors, and simulated on a track with noise, both as compared."""
        campaign, model, stretch = self.measurement.campaign, self.model, self.stretch
        rng = np.random.default_rng(np.random.SeedSequence([seed, self.index]))
        noise, behind = self.measurement.noise, model.half_wheelbase()
        table = stretch.noisy_table(noise, campaign.noise_band, rng, behind, self.steps)
        z = simulate(model, stretch, self.channels, steps=self.steps, table=table, initial=self.start)[0][0]
        white = comparison_filter(campaign, stretch, self.sd[:, None] * rng.standard_normal(z.shape))
        return self.clean + white, comparison_filter(campaign, stretch, z)


def estimate_noise_floor(
    model: Model, measurement: Dataset, stretches: Sequence[Segment], seeds: int = 20, jobs: int | None = None
) -> NoiseFloor:
    """The noise floor: the model taken as true, simulated again on noisy track, sensor noise added."""
    per_seed: list[list[Compared]] = [[] for _ in range(seeds)]
    quiet: list[list[Compared]] = [[] for _ in range(seeds)]
    for index, stretch in enumerate(stretches):
        scene = _SimulatedTruth(model, measurement, stretch, index)
        for seed, (measured, simulated) in enumerate(map_threads(scene.drawn, range(seeds), jobs)):
            per_seed[seed].append((scene.channels, measured, simulated))
            quiet[seed].append((scene.channels, measured, scene.clean))
    all_channels = [nrmse(pairs) for pairs in per_seed]
    totals = [overall_nrmse(c) for c in all_channels]
    return NoiseFloor(
        float(np.mean(totals)),
        float(np.std(totals)),
        {c: float(np.mean([e[c] for e in all_channels])) for c in all_channels[0]},
        float(np.mean([overall_nrmse(nrmse(pairs)) for pairs in quiet])),
    )


def noise_weights(model: Model, measurement: Dataset, stretch: Segment, seeds: int = 3) -> FloatArray:
    """1 / standard deviation per channel of what sensor noise and track noise leave in the band, [channel]."""
    channels, noise, campaign = stretch.channels, measurement.noise, measurement.campaign
    sd = np.array([noise.get(c, 0.0) for c in channels])
    flat = kernel_filter(campaign, stretch, np.ones(len(channels)))
    rng = np.random.default_rng(np.random.SeedSequence([7, stretch.number, stretch.run_index]))
    enough = min(stretch.samples, max(4000, 4 * cut_samples(campaign, stretch)))
    white = comparison_filter(campaign, stretch, rng.standard_normal((1, enough)))
    variance = (sd * white.std()) ** 2
    steps = steps_for(model, stretch)
    clean, lost = simulate(model, stretch, channels, steps=steps, filter=flat)
    if lost[0] < 0:
        for _ in range(seeds):
            table = stretch.noisy_table(noise, campaign.noise_band, rng, model.half_wheelbase(), steps)
            noisy, _ = simulate(model, stretch, channels, steps=steps, filter=flat, table=table)
            variance = variance + np.var(noisy[0] - clean[0], axis=1) / seeds
    measured = comparison_filter(campaign, stretch, stretch.measured(channels)).var(axis=1)
    return np.asarray(1.0 / np.sqrt(np.maximum(variance, 1e-6 * measured + 1e-300)))
