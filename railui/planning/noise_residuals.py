"""Residuals that noise alone leaves: noise of the sensors, and noise of the track record through the model."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.comparison import comparison_filter
from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.identification.prediction import Predictor
from railui.memo import IdentityCache
from railui.parallel import map_threads


def draw_noise_residuals(
    context: Context,
    predictor: Predictor,
    clean: FloatArray,
    filter_and_weight: Callable[[FloatArray], FloatArray],
    seeds: Sequence[Sequence[int]],
) -> FloatArray:
    """Draw residuals [draw, channel, n] of the true model.

    Parameters
    ----------
    predictor
        The model on its segment, with its comparison filter.
    clean : array [channel, n]
        Its prediction on the track without noise.
    filter_and_weight
        Applies the same filter and weights to channels as measured.
    seeds
        Of each draw.
    """
    segment = predictor.segment

    def draw(rng: np.random.Generator) -> FloatArray:
        response = _response_to_input_noise(context, predictor, clean, rng)
        sensors = context.noise.draw(segment.channels, segment.samples, segment.dt, rng)
        return np.asarray(filter_and_weight(sensors) - response)

    return _realisations(draw, seeds, context.jobs)


def draw_responses_to_input_noise(
    context: Context, predictor: Predictor, clean: FloatArray, seeds: Sequence[Sequence[int]]
) -> FloatArray:
    """Draw changes of a prediction [draw, channel, n] by the noise of the track; parameters as above."""
    return _realisations(lambda rng: _response_to_input_noise(context, predictor, clean, rng), seeds, context.jobs)


def _realisations(
    draw: Callable[[np.random.Generator], FloatArray], seeds: Sequence[Sequence[int]], jobs: int | None
) -> FloatArray:
    """Draw a realisation [channel, n] from a stream of random numbers for each seed; stack them."""
    streams = [np.random.default_rng(np.random.SeedSequence(list(seed))) for seed in seeds]
    return np.stack(list(map_threads(draw, streams, jobs)))


def _response_to_input_noise(
    context: Context, predictor: Predictor, clean: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Change of a prediction [channel, n] by noise of the track, or of the input of a rig."""
    spacing, band = predictor.model.wheelset_spacing(), context.campaign.noise_band
    table = predictor.segment.noisy_table(context.noise, band, rng, spacing, predictor.steps)
    noisy, _ = predictor.simulate(table=table)
    return np.asarray(noisy[0] - clean)


class SensorNoise:
    """Sensor noise of runs that have not been made, filtered as they are compared.

    Runs of one length have the same noise, so that it does not decide which of them is better.
    """

    def __init__(self, context: Context, seeds: Sequence[Sequence[int]]) -> None:
        self._context, self._seeds = context, seeds
        self._drawn = IdentityCache[FloatArray](max_size=4)

    def filtered(self, segment: Segment) -> FloatArray:
        """Noise [draw, channel, n] of the sensors of a segment."""
        noise, campaign = self._context.noise, self._context.campaign

        def draw(rng: np.random.Generator) -> FloatArray:
            series = noise.draw(segment.channels, segment.samples, segment.dt, rng)
            return comparison_filter(campaign, segment, series)

        key = (*segment.channels, segment.samples, segment.dt)
        return self._drawn.get(key, lambda: _realisations(draw, self._seeds, 1))
