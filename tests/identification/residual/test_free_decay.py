"""Residual of a free decay: a wrong law leaves lines, noise of any colour does not."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from railui.arrays import FloatArray
from railui.campaign.comparison import Comparison
from railui.campaign.settings.verdict import VerdictSettings
from railui.identification.prediction import Prediction
from railui.identification.residual.free_decay import share_at_harmonics
from tests.truth.campaign import pink

SETTINGS = VerdictSettings()
ERRORS = SETTINGS.coherence_standard_errors
DT, FREQUENCY = 0.005, 2.4  # s, Hz
T = np.arange(2000) * DT


def decay(frequency: float = FREQUENCY, rate: float = 0.2) -> FloatArray:
    return np.asarray(np.exp(-rate * T) * np.cos(2.0 * np.pi * frequency * T))


def prediction(residual: FloatArray, samples: int = len(T)) -> Prediction:
    motion = decay()[None, :samples]
    comparison = Comparison(("z",), motion + residual[None, :samples], motion, DT)
    return Prediction(cast(Any, None), motion, comparison, None)


@pytest.mark.parametrize("seed", range(4))
def test_white_and_coloured_noise_and_drift_have_no_lines(seed: int) -> None:
    rng = np.random.default_rng(seed)
    white, coloured = rng.standard_normal(len(T)), pink(len(T), rng)
    for residual in (white, coloured, coloured + 0.3 * T):
        share = share_at_harmonics([prediction(residual)], ERRORS)
        assert share.share < SETTINGS.min_coherent_share


@pytest.mark.parametrize("wrong", [decay(1.01 * FREQUENCY), decay(rate=0.25), decay() + 0.1 * decay(3.0 * FREQUENCY)])
def test_wrong_frequency_damping_and_shape_leave_lines(wrong: FloatArray) -> None:
    noise = 0.01 * np.random.default_rng(1).standard_normal(len(T))
    share = share_at_harmonics([prediction(wrong - decay() + noise)], ERRORS)
    assert share.share > 0.7 and share.is_significant(SETTINGS.coherence_standard_errors)


def test_a_record_of_a_few_periods_resolves_no_lines() -> None:
    assert np.isnan(share_at_harmonics([prediction(decay(1.01 * FREQUENCY), 600)], ERRORS).share)
