"""Drift of sensors in free decays: what is slow and does not follow the squared amplitude."""

from __future__ import annotations

import numpy as np
import pytest

from railui.campaign.free_decay import is_free_decay, motion_frequency
from railui.campaign.segment import Segment
from railui.campaign.sensor_drift import drift_share, with_drift_removed
from railui.campaign.settings.noise import NoiseSettings
from tests.truth.laws import Array

DT, FREQUENCY = 0.005, 3.0
T = np.arange(2400) * DT
ENVELOPE = 0.03 * np.exp(-0.18 * T)
DECAY = ENVELOPE * np.cos(2.0 * np.pi * FREQUENCY * T)
SETTINGS = NoiseSettings()


def rig(z: Array, **columns: Array) -> Segment:
    return Segment("run.csv", "adjust", 0, {"t": T, "z": z, **columns}, DT, "rig")


@pytest.mark.parametrize("drift", [0.05 * T / T[-1], 0.02 * np.sin(0.4 * T)])
def test_a_drift_of_some_percent_is_found_and_removed_from_every_decay(drift: Array):
    segments = [rig(DECAY), rig(DECAY + 0.03 * drift)]
    filtered = with_drift_removed(segments, SETTINGS)
    assert drift_share(segments[0], "z") < SETTINGS.max_drift_share < drift_share(segments[1], "z")
    assert [s.drift_limit for s in filtered] == pytest.approx([0.2 * FREQUENCY] * 2, rel=0.05)


def test_the_shift_of_an_asymmetric_spring_is_no_drift():
    shifted = rig(DECAY - 3.0 * ENVELOPE**2)  # a tenth of the first amplitude
    assert with_drift_removed([shifted], SETTINGS) == (shifted,)


def test_noise_and_an_offset_are_no_drift():
    noisy = rig(DECAY + 0.01 + 3e-4 * np.random.default_rng(1).standard_normal(len(T)))
    assert with_drift_removed([noisy], SETTINGS) == (noisy,)


def test_a_driven_motion_is_compared_as_before():
    driven = rig(DECAY + 1e-3 * T, u=np.sin(T))
    assert not is_free_decay(driven)
    assert with_drift_removed([driven], SETTINGS) == (driven,)
    assert motion_frequency(driven) == pytest.approx(FREQUENCY, rel=0.05)


def test_a_record_of_few_periods_resolves_no_drift():
    assert not is_free_decay(rig(DECAY + 1e-3 * T).truncated(400))
