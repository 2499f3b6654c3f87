"""Metrics of tracks: bands, spectral densities, nearest spectrum."""

import numpy as np
import pytest

from railui.track import (
    SPECTRA,
    Track,
    band_sd,
    nearest_spectrum,
    psd,
    spectrum_density,
    synthetic_track,
)


def test_the_spectrum_of_a_track_is_the_one_that_it_was_made_of():
    result = psd(synthetic_track("fra_4", length=50_000.0, seed=1))
    inside = (result.wavenumber > 2 * np.pi / 100) & (result.wavenumber < 2 * np.pi / 4)
    for quantity in ("yw", "phiw", "gauge"):
        ratio = getattr(result, quantity)[inside] / spectrum_density("fra_4", quantity, result.wavenumber[inside])
        assert float(np.mean(ratio)) == pytest.approx(1.0, abs=0.02)


def test_a_sine_has_its_standard_deviation_in_its_own_band_only():
    s = 0.1 * np.arange(10_000)
    track = Track(s, 3e-3 * np.sqrt(2) * np.sin(2 * np.pi * s / 40))
    assert band_sd(track) == pytest.approx([0, 3e-3, 0], abs=2e-5)


def test_a_slope_through_the_track_does_not_leak_into_the_bands():
    track = synthetic_track("erri_b176_low", length=5000.0, seed=8)
    tilted = Track(track.s, track.yw + 1e-4 * track.s)
    assert band_sd(tilted) == pytest.approx(band_sd(track), rel=1e-6)


@pytest.mark.parametrize("name", list(SPECTRA))
def test_the_nearest_spectrum_of_a_track_is_its_own(name):
    result = nearest_spectrum(synthetic_track(name, length=5000.0, seed=6))
    assert result is not None and result.name == name
    assert result.factor == pytest.approx(1.0, abs=0.02)


def test_a_flat_track_has_no_nearest_spectrum():
    assert nearest_spectrum(Track(np.arange(100) * 0.1, np.zeros(100))) is None
