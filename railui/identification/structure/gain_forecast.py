"""First-order prediction of the gain of each candidate on the validation runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from railui.campaign.comparison import compared_channels
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.problem import truncate
from railui.identification.structure.candidates import Candidate, CandidateBatch, batch_candidates
from railui.identification.structure.score_test import ScoreTestResult, output_differences
from railui.parallel import map_threads

PredictedGains = Mapping[tuple[Candidate, int], float]


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
    adjuster = GaussNewton(context.in_background(1), fit.model, fit.free, ready, block=1.0, stable=False)
    bases = [adjuster.sensitivities(t, fit.x)[0][1:] for t in ready]
    rows = [[t.segment.channels.index(c) for c in compared_channels(t.segment)] for t in ready]
    power: dict[str, float] = {}
    for t, used in zip(ready, rows, strict=True):
        for i in used:
            c = t.segment.channels[i]
            power[c] = power.get(c, 0.0) + float(np.sum((t.measured[i] / t.filter.weights[i]) ** 2))
    absorbed = {(s.candidate, s.shape): s.absorbed for s in scores.results}

    def predict(batch: CandidateBatch) -> list[tuple[tuple[Candidate, int], float]]:
        keys = [(batch.members[member], shape) for member, shape in batch.lanes]
        added = np.zeros(len(keys))
        for k, (t, base, used) in enumerate(zip(ready, bases, rows, strict=True)):
            differences, is_valid = output_differences(context.settings.score_test, fit, k, batch)
            for lane, key in enumerate(keys):
                if key not in absorbed or not is_valid[lane]:
                    added[lane] = np.nan
                    continue
                unabsorbed = differences[lane] - np.tensordot(absorbed[key], base, 1)
                for i in used:
                    scale = power[t.segment.channels[i]] * t.filter.weights[i] ** 2
                    added[lane] += float(np.sum(unabsorbed[i] ** 2)) / max(scale, 1e-300)
        return [(key, a / len(power)) for key, a in zip(keys, added.tolist(), strict=True) if np.isfinite(a)]

    candidates = list(dict.fromkeys(s.candidate for s in scores.results))
    return {
        key: gain for part in map_threads(predict, batch_candidates(candidates), context.jobs) for key, gain in part
    }
