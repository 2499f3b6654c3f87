"""Part of a vehicle's residual that noise of the track record leaves coherent: with track, motions, other channels.

The model answers the noise of the recorded track, the vehicle does not: the residual of a true model is coherent with
the record, with the simulated motions, and between the channels.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.comparison import compare
from railui.campaign.segment import TRACK_COLUMNS, Segment
from railui.identification.context import Context
from railui.identification.estimation.initial_state import estimate_initial_state, estimate_phases
from railui.identification.prediction import Prediction, Predictor, Simulation, SimulationError
from railui.identification.residual.coherence import ResidualCoherence, Share, residual_coherence
from railui.identification.residual.input_noise_share import noise_share
from railui.parallel import map_threads
from railui.vehicle.model import Model

SEED = 1031
DRAWS = 6
RELATIONS = ("track", "motions", "others")


def without_track_noise(
    context: Context,
    models: Sequence[tuple[Model, Segment]],
    predictions: Sequence[Prediction],
    coherence: dict[str, ResidualCoherence],
) -> dict[str, ResidualCoherence]:
    """Return the coherence of residuals less what noise of the track record leaves at its level.

    Of realisations of this noise, each model taken as true on its segment, the coherent power of the residuals is
    computed as that of the measured ones is; its mean over the power of the measured residual is subtracted, and its
    scatter added to the standard error. Unchanged where no column of the track has noise, or where the models diverge.
    """
    followed = [(m, p) for (m, _), p in zip(models, predictions, strict=True) if p.diverged_at is None]
    if not followed or not any(context.noise.get(c) for c in TRACK_COLUMNS):
        return coherence
    drawn = list(map_threads(lambda pair: _realisations(context, pair[0], pair[1].segment), followed, context.jobs))
    draws = [list(each) for each in zip(*drawn, strict=True) if all(p.diverged_at is None for p in each)]
    if len(draws) < 2:
        return coherence
    powers = [_residual_powers(each) for each in draws]
    measured = _residual_powers([p for _, p in followed])
    of_draws = list(map_threads(lambda each: residual_coherence(context, each), draws, context.jobs))

    def less(name: str, relation: str) -> Share:
        found: Share = getattr(coherence[name], relation)
        shares = [
            getattr(c[name], relation).share * power[name] / max(measured[name], 1e-300)
            for c, power in zip(of_draws, powers, strict=True)
        ]
        scatter = float(np.std(shares, ddof=1) * np.sqrt(1.0 + 1.0 / len(shares)))  # of one realisation about the mean
        return Share(found.share - float(np.mean(shares)), float(np.hypot(found.standard_error, scatter)))

    return {name: ResidualCoherence(*(less(name, relation) for relation in RELATIONS)) for name in coherence}


def _realisations(context: Context, model: Model, segment: Segment) -> list[Prediction]:
    """Predict on track records with noise the motion of a model on a track without, with noise of the sensors.

    That track is the record, each wave number less the share of its power that is noise, so that records with noise
    have the power of this one.
    """
    rng = np.random.default_rng(np.random.SeedSequence([SEED, segment.number, segment.run_index]))
    noises = [segment.draw_input_noise(context.noise, context.campaign.noise_band, rng) for _ in range(DRAWS)]
    less = {
        c: _without_noise(segment.columns[c], [noise[c] for noise in noises]) - segment.columns[c] for c in noises[0]
    }
    try:
        truth = estimate_phases(context, model, segment)
        predictor = Predictor(truth, segment, initial_state=estimate_initial_state(context, truth, segment))
        clean = _simulate(predictor, less).converged()[0]
    except SimulationError:
        return []
    return [
        _realisation(context, predictor, clean, {c: less[c] + x for c, x in noise.items()}, rng) for noise in noises
    ]


def _without_noise(record: FloatArray, noises: Sequence[FloatArray]) -> FloatArray:
    """Return a record [n] less the power of its noise.

    References
    ----------
    Boll, Suppression of acoustic noise in speech using spectral subtraction, IEEE Trans. Acoust. Speech Signal Process.
    27 (1979) 113.
    """
    line = np.linspace(record[0], record[-1], len(record))  # without it the ends would add power at all frequencies
    lines = np.fft.rfft(record - line)
    share = noise_share(np.abs(lines) ** 2, np.mean([np.abs(np.fft.rfft(x)) ** 2 for x in noises], axis=0))
    return np.asarray(line + np.fft.irfft(lines * np.sqrt(1.0 - share), len(record)))


def _simulate(predictor: Predictor, change: Mapping[str, FloatArray]) -> Simulation:
    """Simulate all measured channels on the track record with a change of its columns."""
    table = predictor.segment.table_with_noise(change, predictor.model.wheelset_spacing(), predictor.steps)
    return predictor.simulate(table=table)


def _realisation(
    context: Context,
    predictor: Predictor,
    clean: FloatArray,
    change: Mapping[str, FloatArray],
    rng: np.random.Generator,
) -> Prediction:
    """Predict on a changed track record what was measured of a motion [channel, n], with noise of the sensors."""
    segment, names = predictor.segment, predictor.segment.channels
    series, diverged = _simulate(predictor, change)
    measured = clean + context.noise.draw(names, segment.samples, segment.dt, rng)
    columns = {c: segment.columns[c] + x for c, x in change.items()} | dict(zip(names, measured, strict=True))
    record = replace(segment, columns={**segment.columns, **columns}, tables={})
    diverged_at = None if diverged[0] < 0 else float(segment.columns["t"][diverged[0]])
    return Prediction(record, series[0], compare(context.campaign, record, series[0]), diverged_at)


def _residual_powers(predictions: Sequence[Prediction]) -> dict[str, float]:
    """Sum of the squared residuals of every compared channel over segments."""
    powers: dict[str, float] = {}
    for c in (p.comparison for p in predictions):
        for name, residual in zip(c.channels, c.measured - c.simulated, strict=True):
            powers[name] = powers.get(name, 0.0) + float(np.sum(residual**2))
    return powers
