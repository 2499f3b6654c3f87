"""Spectra that noise of the measured input of a rig leaves in its channels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.comparison import compared_channels, comparison_filter
from railui.campaign.segment import Segment
from railui.dsp.spectra import hann_periodogram
from railui.identification.context import Context
from railui.identification.estimation.initial_state import estimate_initial_state
from railui.identification.prediction import Predictor, SimulationError
from railui.vehicle.model import Model

SEED = 23
DRAWS = 8
LEVEL = 1e-3  # of the noise, in the standard deviation of the input: small for a nonlinear rig too
INPUT = "u"


@dataclass(frozen=True, eq=False)
class InputNoiseSpectra:
    """Densities [F] of the input of a rig, of a white noise of it, and of the channels' responses to that noise."""

    input: FloatArray
    noise: FloatArray
    responses: Mapping[str, FloatArray]


def input_noise_spectra(
    context: Context, model: Model, segment: Segment, column: str = INPUT, level: float | None = None
) -> InputNoiseSpectra | None:
    """Simulate the response of a rig to noise of its measured input; None without an input, or where it diverges.

    Parameters
    ----------
    column
        Input with the noise.
    level
        Standard deviation of the noise; by default a thousandth of that of the input.
    """
    if not np.any(segment.columns.get(column, 0.0)):
        return None
    names, campaign = compared_channels(segment), context.campaign
    sd = LEVEL * float(np.std(segment.columns[column])) if level is None else level

    def density(series: FloatArray) -> FloatArray:
        """Densities [channel, F] of series [channel, n] as they are compared."""
        compared = comparison_filter(campaign, segment, series)
        return np.array([hann_periodogram(x, 1.0 / segment.dt)[1] for x in compared])

    try:
        predictor = Predictor(model, segment, initial_state=estimate_initial_state(context, model, segment))
        clean, _ = predictor.simulate(names)
    except SimulationError:
        return None
    rng = np.random.default_rng(np.random.SeedSequence([SEED, segment.number, segment.run_index]))
    noises, responses = [], []
    for _ in range(DRAWS):
        noise = sd * rng.standard_normal(segment.samples)
        table = segment.table_with_noise({column: noise}, model.wheelset_spacing(), predictor.steps)
        series, diverged = predictor.simulate(names, table=table)
        if diverged[0] >= 0:
            return None
        noises.append(density(noise[None])[0])
        responses.append(density(series[0] - clean[0]))
    mean = np.mean(responses, axis=0)
    of_input = density(segment.columns[column][None])[0]
    return InputNoiseSpectra(of_input, np.mean(noises, axis=0), dict(zip(names, mean, strict=True)))
