"""Coherence of residuals with track, motions and other residuals: noise, missing motions, short records."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from railui.campaign.comparison import compare
from railui.identification.context import Context
from railui.identification.estimation.validation import predict_each
from railui.identification.prediction import Prediction
from railui.identification.residual.coherence import (
    ResidualCoherence,
    residual_coherence,
)
from tests.blind.simulated import simulated_campaign

CHANNELS = ("e1", "ay1", "ayf")


@pytest.fixture(scope="module")
def simulated() -> tuple[Context, list[Prediction]]:
    """A context, and the nominal model on the runs of its campaign."""
    context = simulated_campaign().context
    return context, predict_each(context, [(context.nominal, s) for s in context.dataset.segments])


def with_residual(context: Context, prediction: Prediction, extra: dict[str, Any]) -> Prediction:
    """Take the simulated channels, plus a series per channel, as measured."""
    segment = prediction.segment
    series = dict(zip(segment.channels, prediction.series, strict=True))
    measured = {c: x + extra.get(c, 0.0) for c, x in series.items()}
    changed = replace(segment, columns={**segment.columns, **measured}, tables={})
    return replace(prediction, segment=changed, comparison=compare(context.campaign, changed, prediction.series))


def coherence_with(
    simulated: tuple[Context, list[Prediction]], mix: float, seed: int, source: str = "yw"
) -> dict[str, ResidualCoherence]:
    """Coherence where the residual of CHANNELS is white noise and `mix` times as much of a filtered column."""
    context, predictions = simulated
    rng = np.random.default_rng(seed)
    changed = []
    for p in predictions:
        n = p.segment.samples
        series = dict(zip(p.segment.channels, p.series, strict=True))
        motion = np.gradient(np.gradient(series[source] if source in series else p.segment.columns[source]))
        motion = motion / motion.std()
        extra = {c: 1e-3 * (rng.standard_normal(n) + mix * motion) for c in p.segment.channels}
        extra = {c: x if c in CHANNELS else 1e-3 * rng.standard_normal(n) for c, x in extra.items()}
        changed.append(with_residual(context, p, extra))
    return residual_coherence(context, changed)


def test_white_noise_is_coherent_with_nothing(simulated: tuple[Context, list[Prediction]]):
    scores = []
    for seed in range(4):
        for c in coherence_with(simulated, 0.0, seed).values():
            scores += [x.share / x.standard_error for x in (c.track, c.motions, c.others)]
    assert abs(np.mean(scores)) < 0.25
    assert np.mean(np.abs(scores) > 2.0) < 0.05


def test_a_residual_that_follows_the_track_is_coherent_with_it(simulated: tuple[Context, list[Prediction]]):
    found = coherence_with(simulated, 1.0, 1)
    for name in CHANNELS:
        assert found[name].track.share > 0.5 and found[name].track.is_significant(2.0)
    assert not found["d1"].track.is_significant(2.0)


def test_the_share_is_that_of_the_power(simulated: tuple[Context, list[Prediction]]):
    """A motion and white noise of known powers in the band."""
    context, predictions = simulated
    rng = np.random.default_rng(5)
    changed, parts = [], np.zeros(2)
    for p in predictions:
        motion = 0.1 * dict(zip(p.segment.channels, p.series, strict=True))["ayf"]
        white = rng.standard_normal(len(motion)) * motion.std()
        for i, x in enumerate((motion, white)):
            compared = with_residual(context, p, {"ayf": x}).comparison
            row = compared.channels.index("ayf")
            parts[i] += np.sum((compared.measured[row] - compared.simulated[row]) ** 2)
        changed.append(with_residual(context, p, {"ayf": motion + white}))
    share = residual_coherence(context, changed)["ayf"].motions
    assert share.share == pytest.approx(parts[0] / parts.sum(), abs=0.06)
    assert abs(share.share - parts[0] / parts.sum()) < 4.0 * share.standard_error


def test_a_force_common_to_channels_is_coherent_between_their_residuals(simulated: tuple[Context, list[Prediction]]):
    context, predictions = simulated
    rng = np.random.default_rng(2)
    changed = []
    for p in predictions:
        force = 0.1 * rng.standard_normal(p.segment.samples)
        extra = {c: 0.05 * rng.standard_normal(p.segment.samples) for c in p.segment.channels}
        extra["ay1"], extra["ayf"] = extra["ay1"] + force, extra["ayf"] + 0.5 * force
        changed.append(with_residual(context, p, extra))
    found = residual_coherence(context, changed)
    assert found["ay1"].others.share > 0.3 and found["ayf"].others.share > 0.3
    assert not found["ay1"].track.is_significant(2.0) and not found["ay2"].others.is_significant(2.0)


def test_a_record_too_short_for_spectra_has_no_share(simulated: tuple[Context, list[Prediction]]):
    context, predictions = simulated
    p = predictions[0]
    short = p.segment.truncated(round(6.0 / p.segment.dt))
    series = p.series[:, : short.samples]
    found = residual_coherence(context, [Prediction(short, series, compare(context.campaign, short, series))])
    assert np.isnan(found["ay1"].motions.share) and not found["ay1"].motions.is_significant(2.0)


def test_a_diverged_prediction_is_left_out(simulated: tuple[Context, list[Prediction]]):
    context, predictions = simulated
    assert residual_coherence(context, [replace(predictions[0], diverged_at=1.0)]) == {}
