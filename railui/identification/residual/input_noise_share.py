"""Part of a residual that noise of the recorded input of a rig leaves coherent: with this input, and between channels.

The model answers the noise of a recorded input, the rig does not. Where the drive itself has no power, the record is
noise alone, and the residual is coherent with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.noise.bounds import is_flat, quiet_level
from railui.campaign.segment import Segment
from railui.dsp.spectra import hann_periodogram
from railui.identification.context import Context
from railui.identification.prediction import Prediction
from railui.identification.residual.coherence import ResidualCoherence, Share
from railui.identification.residual.input_noise import InputNoiseSpectra, input_noise_spectra
from railui.parallel import map_threads
from railui.vehicle.model import Model

SMOOTHED_LINES = 31  # of a periodogram, in a moving mean: the width of the windows of the coherence


class InputNoiseShare(NamedTuple):
    """Shares of the power of a residual: response to noise of the input, and its part coherent with the input."""

    response: float
    coherent: float


def input_noise_shares(
    context: Context, models: Sequence[Model], predictions: Sequence[Prediction]
) -> dict[str, InputNoiseShare]:
    """Compute what the noise of the input columns, at its level, leaves in the residual of each channel.

    Parameters
    ----------
    predictions
        Of the models, each on its record of a rig; those that diverge are left out.
    """
    followed = [(m, p) for m, p in zip(models, predictions, strict=True) if p.diverged_at is None]
    powers: dict[str, FloatArray] = {}  # of the residual, of the response and of its coherent part
    for (_, prediction), spectra in zip(
        followed, map_threads(lambda pair: _spectra(context, *pair), followed, context.jobs), strict=True
    ):
        compared = prediction.comparison
        for name, residual in zip(compared.channels, compared.measured - compared.simulated, strict=True):
            total = float(hann_periodogram(residual, 1.0 / compared.dt)[1].sum())
            parts = np.array([total, 0.0, 0.0])
            for of_column in spectra:
                response = of_column.responses[name]
                of_record = noise_share(of_column.input, of_column.noise)
                parts[1:] += response.sum(), (response * of_record).sum()
            powers[name] = powers.get(name, np.zeros(3)) + parts
    return {
        name: InputNoiseShare(float(response / total), float(coherent / total))
        for name, (total, response, coherent) in powers.items()
        if total > 0.0
    }


def _spectra(context: Context, model: Model, prediction: Prediction) -> list[InputNoiseSpectra]:
    """Spectra of all inputs of a segment that have noise."""
    segment = prediction.segment
    noisy = [c for c in segment.input_columns if context.noise.get(c)]
    found = [input_noise_spectra(context, model, segment, c, _own_level(context, segment, c)) for c in noisy]
    return [s for s in found if s is not None]


def _own_level(context: Context, segment: Segment, column: str) -> float:
    """Level of the noise of an input on a segment: that of the top of its spectrum there, where it is noise alone.

    Ranges of amplifiers differ from run to run. A drive that may fill its spectrum has its stated noise.
    """
    known, tolerance = context.noise.columns[column], float(np.log(context.settings.noise.quiet_noise_factor))
    is_noise_alone = segment.kind == "bench" or known.stated is None
    quiet = quiet_level([segment], column, tolerance)
    is_used = is_noise_alone and quiet is not None and is_flat(segment, column, tolerance)
    return float(np.exp(quiet.log)) if is_used and quiet is not None else known.used


def noise_share(recorded: FloatArray, noise: FloatArray) -> FloatArray:
    """Return the share of the recorded power of an input that is its noise, per frequency, of periodograms [F]."""
    mean = np.full(SMOOTHED_LINES, 1.0 / SMOOTHED_LINES)
    smooth, of_noise = (np.convolve(x, mean, "same") for x in (recorded, noise))
    return np.asarray(np.minimum(of_noise / np.maximum(smooth, 1e-300), 1.0))


def without_input_noise(
    coherence: Mapping[str, ResidualCoherence], shares: Mapping[str, InputNoiseShare]
) -> dict[str, ResidualCoherence]:
    """Return the coherence of residuals less what noise of the input leaves."""

    def less(share: Share, part: float) -> Share:
        return share._replace(share=share.share - part)

    none = InputNoiseShare(0.0, 0.0)
    found = {}
    for name, c in coherence.items():
        noise = shares.get(name, none)
        inputs = {key: less(getattr(c, key), noise.coherent) for key in ("track", "motions")}
        found[name] = replace(c, **inputs, others=less(c.others, noise.response))
    return found
