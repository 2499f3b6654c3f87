"""What a little of every candidate would do to the error on the validating runs, where an effect must gain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from railui.campaign.dataset import Dataset
from railui.identification.estimation.output_error import Fit, GaussNewton
from railui.identification.estimation.problem import truncate
from railui.identification.estimation.validation import compared_channels
from railui.identification.structure.candidates import Candidate, CandidateBatch, batch_candidates
from railui.identification.structure.score_test import ScoreTestResult, output_differences
from railui.parallel import map_threads

LOOKED_AT = 10.0  # seconds of each validating stretch

PredictedGains = Mapping[tuple[Candidate, int], float]


def predict_validation_gain(
    laid: Fit | None, trace: ScoreTestResult, measurement: Dataset, *, jobs: int | None = None
) -> PredictedGains:
    """By candidate and shape: nrmse^2 on the validating runs that an amount of one adds to a vehicle without it.

    The vehicle was adjusted on the other runs: what its parameters absorbed there is taken off as they will, at
    the speeds and on the track of these. To first order in the effect; nothing where the vehicle hunts there.

    laid: the adjusted vehicle laid on the validating runs.
    """
    if laid is None:
        return {}  # what hunts there is not of first order
    ready = truncate(laid.segments, measurement, LOOKED_AT)
    here = replace(laid, segments=tuple(ready))
    adjuster = GaussNewton(here.model, here.free, ready, block=1.0, stable=False, jobs=1)
    bases = [adjuster.sensitivities(t, here.x)[0][1:] for t in ready]
    rows = [[t.segment.channels.index(c) for c in compared_channels(t.segment)] for t in ready]
    power: dict[str, float] = {}
    for t, used in zip(ready, rows, strict=True):
        for i in used:
            c = t.segment.channels[i]
            power[c] = power.get(c, 0.0) + float(np.sum((t.measured[i] / t.filter.weights[i]) ** 2))
    absorbed = {(s.candidate, s.shape): s.absorbed for s in trace.results}

    def look(bundle: CandidateBatch) -> list[tuple[tuple[Candidate, int], float]]:
        keys = [(bundle.members[member], shape) for member, shape in bundle.lanes]
        added = np.zeros(len(keys))
        for k, (t, base, used) in enumerate(zip(ready, bases, rows, strict=True)):
            series, fine = output_differences(here, k, bundle)
            for lane, key in enumerate(keys):
                if key not in absorbed or not fine[lane]:
                    added[lane] = np.nan
                    continue
                rest = series[lane] - np.tensordot(absorbed[key], base, 1)
                for i in used:
                    scale = power[t.segment.channels[i]] * t.filter.weights[i] ** 2
                    added[lane] += float(np.sum(rest[i] ** 2)) / max(scale, 1e-300)
        return [(key, a / len(power)) for key, a in zip(keys, added.tolist(), strict=True) if np.isfinite(a)]

    found = list(dict.fromkeys(s.candidate for s in trace.results))
    return {key: a for part in map_threads(look, batch_candidates(found), jobs) for key, a in part}
