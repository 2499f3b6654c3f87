"""Vibration in a residual: a second mode or a modulated resonance, unlike noise of any smooth spectrum."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from railui.arrays import FloatArray
from railui.campaign.comparison import Comparison
from railui.campaign.settings.verdict import VerdictSettings
from railui.core import sosfilt
from railui.dsp.filters import butterworth
from railui.dsp.spectra import hann_periodogram
from railui.identification.prediction import Prediction
from railui.identification.residual.input_noise import InputNoiseSpectra
from railui.identification.residual.noise_evidence import is_vibration
from railui.identification.residual.vibration import vibration_share
from tests.truth.campaign import pink

SETTINGS = VerdictSettings()
DT = 0.005
T = np.arange(2000) * DT


def prediction(residual: FloatArray) -> Prediction:
    comparison = Comparison(("z",), residual[None], np.zeros((1, len(residual))), DT)
    return Prediction(cast(Any, None), comparison.simulated, comparison, None)


@pytest.mark.parametrize("seed", range(4))
def test_white_and_coloured_noise_and_drift_are_no_vibration(seed: int) -> None:
    rng = np.random.default_rng(seed)
    white, walk = rng.standard_normal(len(T)), np.cumsum(rng.standard_normal(len(T)))
    low_pass = sosfilt(butterworth(2, [8.0], 1.0 / DT), white[None], np.zeros((1, 1, 2)))[0]
    for residual in (white, pink(len(T), rng), walk, low_pass, white + 5.0 * T):
        assert not is_vibration(SETTINGS, vibration_share(SETTINGS, [prediction(residual)]))


@pytest.mark.parametrize("seed", range(4))
def test_a_second_mode_and_a_resonance_are_vibrations(seed: int) -> None:
    rng = np.random.default_rng(seed)
    noise = 0.02 * rng.standard_normal(len(T))
    mode = np.exp(-0.2 * T) * np.cos(2.0 * np.pi * 5.0 * T)
    resonance = sosfilt(butterworth(1, [2.8, 3.2], 1.0 / DT), rng.standard_normal((1, len(T))), np.zeros((1, 1, 2)))[0]
    for residual in (mode, resonance / resonance.std()):
        assert is_vibration(SETTINGS, vibration_share(SETTINGS, [prediction(residual + noise)]))


@pytest.mark.parametrize("seed", range(4))
def test_a_resonance_is_a_vibration_unless_noise_of_the_input_may_be_so_large(seed: int) -> None:
    rng = np.random.default_rng(seed)
    resonance = butterworth(1, [2.8, 3.2], 1.0 / DT)

    def answer(noise: FloatArray) -> FloatArray:
        return np.asarray(sosfilt(resonance, noise[None], np.zeros((1, 1, 2)))[0])

    record = prediction(answer(rng.standard_normal(len(T))))
    noises = rng.standard_normal((20, len(T)))
    density = np.mean([hann_periodogram(x, 1.0 / DT)[1] for x in noises], axis=0)
    response = np.mean([hann_periodogram(answer(x), 1.0 / DT)[1] for x in noises], axis=0)
    for share, expected in ((0.5, False), (2.0, True)):  # of the noise that is admissible
        level = (share * SETTINGS.max_input_noise_share) ** -2
        spectra = {record.segment: InputNoiseSpectra(level * density, density, {"z": response})}
        assert is_vibration(SETTINGS, vibration_share(SETTINGS, [record], spectra)) is expected


@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_a_vibration_of_one_channel_counts_in_any_unit(unit: float) -> None:
    rng = np.random.default_rng(5)
    vibrating = unit * (np.cos(2.0 * np.pi * 5.0 * T) + 0.02 * rng.standard_normal(len(T)))
    residuals = np.stack([vibrating, 50.0 * rng.standard_normal(len(T))])
    comparison = Comparison(("z", "az"), residuals, np.zeros_like(residuals), DT)
    share = vibration_share(SETTINGS, [Prediction(cast(Any, None), comparison.simulated, comparison, None)])
    assert share.share > 0.9 and is_vibration(SETTINGS, share)
