"""First-order prediction of the gain of each candidate on the validation runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.comparison import compared_channels
from railui.identification.context import Context
from railui.identification.estimation.block_products import block_length
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.problem import truncate
from railui.identification.estimation.validation import error_block_duration
from railui.identification.prediction import DivergedError
from railui.identification.structure.candidates import Candidate, CandidateBatch, batches_on
from railui.identification.structure.score_test import ScoreTestResult, output_differences
from railui.parallel import map_threads


@dataclass(frozen=True)
class PredictedGain:
    """Prediction of the NRMSE^2 on the validation runs that an amount of 1 of an effect adds.

    Attributes
    ----------
    mean
        NRMSE^2, which grows as the square of the amount.
    noise_sd
        Standard deviation of the product of effect and residual noise, as NRMSE^2 per amount.
    scatter
        Relative standard error of `mean`, because only a part of the runs is simulated.
    """

    mean: float
    noise_sd: float = 0.0
    scatter: float = 0.0


PredictedGains = Mapping[tuple[Candidate, int], PredictedGain]


def predict_validation_gain(context: Context, validation_fit: Fit | None, scores: ScoreTestResult) -> PredictedGains:
    """Predict the NRMSE^2 on the validation runs that an amount of 1 adds, by candidate and shape.

    The part that the parameters absorbed on the estimation runs is subtracted as it acts at the speeds and on the track
    of the validation runs. The prediction is of first order in the effect.

    Parameters
    ----------
    validation_fit
        The calibrated model prepared on the validation runs; None if it hunts there, which yields no prediction.
    scores
        Result of the score test, with the part of each candidate that the parameters absorb.
    """
    if validation_fit is None:
        return {}  # a hunting vehicle does not respond to first order
    ready = truncate(context, validation_fit.segments, context.settings.selection.gain_forecast_duration)
    fit = replace(validation_fit, segments=tuple(ready))
    adjuster = GaussNewton.of_fit(context.in_background(context.jobs), fit, ready)
    try:
        linear = list(map_threads(lambda t: adjuster.sensitivities(t, fit.x).converged(), ready, context.jobs))
    except DivergedError:
        return {}
    rows = [[t.segment.channels.index(c) for c in compared_channels(t.segment)] for t in ready]
    power: dict[str, float] = {}
    for t, used in zip(ready, rows, strict=True):
        for i in used:
            c = t.segment.channels[i]
            power[c] = power.get(c, 0.0) + float(np.sum((t.measured[i] / t.filter.weights[i]) ** 2))
    scales = [
        np.array([1.0 / max(power[t.segment.channels[i]] * t.filter.weights[i] ** 2, 1e-300) for i in used])
        for t, used in zip(ready, rows, strict=True)
    ]
    absorbed = {(s.candidate, s.shape): s.absorbed for s in scores.results}
    seconds = error_block_duration(context, [t.segment for t in validation_fit.segments])
    lengths = [block_length(seconds, t) for t in ready]
    share = sum(t.measured.shape[1] for t in ready) / sum(t.measured.shape[1] for t in validation_fit.segments)

    def predict(batch: CandidateBatch) -> list[tuple[tuple[Candidate, int], PredictedGain]]:
        keys = [(batch.members[member], shape) for member, shape in batch.lanes]
        gains: list[list[FloatArray]] = [[] for _ in keys]
        for k, (base, used) in enumerate(zip(linear, rows, strict=True)):
            differences, is_valid = output_differences(context.settings, fit.model, fit.segments[k], batch)
            for lane, key in enumerate(keys):
                if key not in absorbed or not is_valid[lane]:
                    gains[lane].append(np.full((1, 2), np.nan))
                    continue
                unabsorbed = (differences[lane] - np.tensordot(absorbed[key], base[1:], 1))[used]
                products = np.stack([scales[k] @ unabsorbed**2, scales[k] @ (unabsorbed * base[0][used])], axis=1)
                gains[lane].append(np.add.reduceat(products, np.arange(0, len(products), lengths[k])) / len(power))
        found = [(key, _summary(np.concatenate(blocks), share)) for key, blocks in zip(keys, gains, strict=True)]
        return [(key, gain) for key, gain in found if np.isfinite(gain.mean)]

    candidates = list(dict.fromkeys(s.candidate for s in scores.results))
    return {
        key: gain
        for of_batch in map_threads(predict, batches_on(fit.model, candidates), context.jobs)
        for key, gain in of_batch
    }


def _summary(blocks: FloatArray, share: float) -> PredictedGain:
    """Summarise blocks [block, 2] of the squared effect and of its product with noise, from a share of the runs.

    A single block of a part of the runs has no scatter that could be known: its mean is NaN.
    """
    squares, products = blocks.T
    mean, count, left_out = float(squares.sum()), len(squares), max(1.0 - share, 0.0)
    if count < 2 and left_out > 0.0:
        return PredictedGain(np.nan, np.nan, np.inf)
    variance = float(squares.var(ddof=1)) if count > 1 else 0.0
    scatter = float(np.sqrt(left_out * count * variance)) / max(mean, 1e-300)
    return PredictedGain(mean, float(np.sqrt(share * np.sum(products**2))), scatter)
