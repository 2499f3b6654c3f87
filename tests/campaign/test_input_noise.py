"""White noise of the recorded input of a rig, and a drive that fills its spectrum."""

from __future__ import annotations

import numpy as np
import pytest

from railui.arrays import FloatArray
from railui.campaign.noise.estimate import estimate_noise_model
from railui.campaign.segment import Segment
from railui.campaign.settings.noise import NoiseSettings
from railui.dsp.filters import butterworth, sosfiltfilt
from railui.vehicle.track_geometry import TrackGeometry
from tests.truth.campaign import pink

RATE, SAMPLES = 200.0, 6000
RNG = np.random.default_rng(8)
DRIVE = sosfiltfilt(butterworth(4, [8.0], RATE), RNG.standard_normal((1, SAMPLES)))[0]
DRIVE = DRIVE / DRIVE.std()
WHITE = 0.03 * RNG.standard_normal(SAMPLES)


def mass(force: FloatArray) -> FloatArray:
    """Acceleration of a mass that follows a force from 2 Hz on, with noise of its sensor."""
    slow = sosfiltfilt(butterworth(2, [2.0], RATE), force[None])[0]
    return np.asarray(force - slow + 0.01 * RNG.standard_normal(SAMPLES))


def noise_of(u: FloatArray, az: FloatArray) -> float | None:
    rig = Segment("a", "adjust", 0, {"t": np.arange(SAMPLES) / RATE, "u": u, "az": az}, 1.0 / RATE, "rig")
    return estimate_noise_model([rig], {}, TrackGeometry(), None, 2.5, NoiseSettings()).get("u")


def test_white_noise_of_the_record_is_estimated() -> None:
    assert noise_of(DRIVE + WHITE, mass(DRIVE)) == pytest.approx(0.03, rel=0.05)


def test_a_white_part_that_the_mass_follows_is_a_force() -> None:
    assert noise_of(DRIVE + WHITE, mass(DRIVE + WHITE)) is None


@pytest.mark.parametrize("drive", [pink(SAMPLES, RNG), RNG.standard_normal(SAMPLES)], ids=["pink", "white"])
def test_a_drive_that_fills_its_spectrum_is_no_noise(drive: FloatArray) -> None:
    assert noise_of(drive, RNG.standard_normal(SAMPLES)) is None


def test_a_short_record_does_not_show_it() -> None:
    rig = Segment(
        "a", "adjust", 0, {"t": np.arange(900) / RATE, "u": (DRIVE + WHITE)[:900], "z": DRIVE[:900]}, 1 / RATE, "rig"
    )
    assert "u" not in estimate_noise_model([rig], {}, TrackGeometry(), None, 2.5, NoiseSettings())
