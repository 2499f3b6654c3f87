"""Coherence that noise of the track record leaves in the residual of a true model."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from railui.campaign.noise.model import NoiseModel
from railui.campaign.segment import TRACK_COLUMNS
from railui.identification.estimation.validation import predict_each
from railui.identification.residual.coherence import residual_coherence
from railui.identification.residual.noise_evidence import examine_residual
from railui.identification.residual.track_noise_coherence import _without_noise, without_track_noise
from tests.blind.simulated import Request, SimulatedCampaign, calibrated, simulate_together, simulated_campaign

SEEDS = (11, 12, 13, 14)
SECONDS = (40.0, 40.0)
CLEARANCE = "free_play at=primary_lateral half_width=0.4e-3"


@cache
def sound(seed: int) -> SimulatedCampaign:
    simulate_together(*(Request(seed=s, seconds=SECONDS) for s in SEEDS))
    return simulated_campaign(seed=seed, seconds=SECONDS)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_residual_of_a_sound_campaign_is_not_coherent(seed: int) -> None:
    """The model answers the noise of the record: before the subtraction it is."""
    case = sound(seed)
    model = calibrated(seed=seed, seconds=SECONDS).model
    pairs = [(model, s) for s in case.dataset.selection]
    raw = residual_coherence(case.context, predict_each(case.context, pairs))
    assert max(c.track.share for c in raw.values()) > 0.3
    evidence = examine_residual(case.context, model)
    assert evidence.is_noise and not evidence.is_coherent and not evidence.is_shared


def test_the_residual_of_an_unmodelled_effect_remains_coherent() -> None:
    case = simulated_campaign(CLEARANCE)
    evidence = examine_residual(case.context, calibrated(CLEARANCE).model)
    assert evidence.is_coherent and evidence.share > 0.25 and not evidence.is_noise


def test_a_track_without_noise_changes_no_share() -> None:
    case = sound(SEEDS[0])
    pairs = [(case.nominal, s) for s in case.dataset.selection]
    columns = {c: n for c, n in case.context.noise.columns.items() if c not in TRACK_COLUMNS}
    context = replace(case.context, dataset=replace(case.dataset, noise=NoiseModel(columns)))
    predictions = predict_each(context, pairs)
    raw = residual_coherence(context, predictions)
    assert without_track_noise(context, pairs, predictions, raw) is raw


def test_a_record_less_its_noise_has_little_of_it_left() -> None:
    rng = np.random.default_rng(4)
    n = 20000
    signal = np.cumsum(rng.standard_normal(n)) + 0.01 * np.arange(n)
    noises = [3.0 * rng.standard_normal(n) for _ in range(7)]
    record = signal + noises[0]
    found = _without_noise(record, noises[1:])
    # in the first differences, where noise dominates, a ninth part of its power; long waves are those of the record
    assert np.var(np.diff(record)) == pytest.approx(19.0, rel=0.05)
    assert np.var(np.diff(found)) - 1.0 < 18.0 / 9.0
    smooth = np.ones(100) / 100
    assert np.std(np.convolve(found - record, smooth, "valid")) < 0.2 * np.std(np.convolve(noises[0], smooth, "valid"))
