"""Residuals that noise alone leaves: noise of the sensors, and noise of the track record through the model."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from railui.arrays import FloatArray
from railui.identification.context import Context
from railui.identification.prediction import Predictor
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
    segment, noise = predictor.segment, context.noise
    spacing, band = predictor.model.wheelset_spacing(), context.campaign.noise_band

    def draw(seed: Sequence[int]) -> FloatArray:
        rng = np.random.default_rng(np.random.SeedSequence(list(seed)))
        table = segment.noisy_table(noise, band, rng, spacing, predictor.steps)
        noisy, _ = predictor.simulate(table=table)
        sensors = noise.draw(segment.channels, segment.samples, segment.dt, rng)
        return np.asarray(filter_and_weight(sensors) - (noisy[0] - clean))

    return np.stack(list(map_threads(draw, seeds, context.jobs)))
