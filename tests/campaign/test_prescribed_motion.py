"""Bandwidth of prescribed motions: noise that would distort the speed, and motions that are left as recorded."""

from __future__ import annotations

import numpy as np
import pytest

from railui.campaign.prescribed_motion import motion_bandwidth, with_motion_bandwidth
from railui.campaign.segment import Segment
from railui.campaign.settings.noise import NoiseSettings
from tests.truth.laws import Array

DT, FREQUENCY, AMPLITUDE = 0.002, 1.5, 8e-3
T = np.arange(3000) * DT
SETTINGS = NoiseSettings()


def bench(z: Array, noise: float = 0.0) -> Segment:
    noisy = z + noise * np.random.default_rng(1).standard_normal(len(z))
    return Segment("run.csv", "adjust", 0, {"t": T, "z": noisy, "F": np.zeros(len(z))}, DT, "bench")


SINE = AMPLITUDE * np.sin(2.0 * np.pi * FREQUENCY * T)
SPEED = AMPLITUDE * 2.0 * np.pi * FREQUENCY * np.cos(2.0 * np.pi * FREQUENCY * T)


@pytest.mark.parametrize("noise", [4e-6, 6e-5])
def test_the_speed_of_a_noisy_motion_is_that_of_the_motion(noise: float):
    segment = bench(SINE, noise)
    smooth = with_motion_bandwidth([segment], "motion", SETTINGS)[0]
    inner = slice(100, -100)  # the ends are left out of a comparison
    raw, speed = (s.table(0.0, 1)[::2, 3][inner] - SPEED[inner] for s in (segment, smooth))
    assert speed.std() < 0.1 * raw.std() and speed.std() < 0.02 * SPEED.std()


def test_noise_of_a_noisy_realisation_passes_the_same_low_pass():
    smooth = with_motion_bandwidth([bench(SINE, 6e-5)], "motion", SETTINGS)[0]
    noisy = smooth.noisy_table({"z": 6e-5}, 0.0, np.random.default_rng(2), 0.0, 1)
    assert (noisy - smooth.table(0.0, 1))[:, 3].std() < 0.02 * SPEED.std()


def test_a_motion_with_little_noise_is_left_as_recorded():
    assert motion_bandwidth(bench(SINE, 1e-8), "z", SETTINGS) is None
    segment = bench(SINE)
    assert with_motion_bandwidth([segment], "motion", SETTINGS)[0].motion_bandwidth == {}


def test_a_motion_that_fills_the_spectrum_is_left_as_recorded():
    assert motion_bandwidth(bench(1e-3 * np.random.default_rng(3).standard_normal(len(T))), "z", SETTINGS) is None


def test_reversals_of_a_triangular_motion_are_kept():
    triangle = AMPLITUDE * (2.0 / np.pi) * np.arcsin(np.sin(2.0 * np.pi * FREQUENCY * T))
    limit = motion_bandwidth(bench(triangle, 4e-6), "z", SETTINGS)
    assert limit is None or limit > 20.0 * FREQUENCY


def test_an_input_whose_speed_does_not_act_is_left_as_recorded():
    segment = Segment("run.csv", "adjust", 0, {"t": T, "u": bench(SINE, 6e-5).columns["z"]}, DT, "rig")
    assert with_motion_bandwidth([segment], "force", SETTINGS)[0].motion_bandwidth == {}
    assert with_motion_bandwidth([segment], None, SETTINGS)[0].motion_bandwidth == {}
    assert with_motion_bandwidth([segment], "base_displacement", SETTINGS)[0].motion_bandwidth["u"] < 20.0
