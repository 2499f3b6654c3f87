"""Synthetic tracks, their specification, and noise."""

import numpy as np
import pytest

from railui.track import (
    SPECTRA,
    Track,
    TrackSpec,
    band_limited_noise,
    band_sd,
    parse_spec,
    spectrum_density,
    spectrum_sd,
    synthetic_track,
)
from railui.track.excitation import resolve_track


def test_a_synthetic_track_is_the_sum_of_its_harmonics():
    length, seed, spacing = 600.0, 5, 0.25
    track = synthetic_track("fra_4", length=length, seed=seed, spacing=spacing, shortest=4, longest=60, ease_in=0)
    s = spacing * np.arange(2400)
    for index, quantity in enumerate(("yw", "phiw", "gauge")):
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, index])))
        phases = rng.uniform(0, 2 * np.pi, 150)
        by_hand = np.zeros_like(s)
        for k in range(10, 151):  # 600 m/10 = 60 m, 600 m/150 = 4 m
            w = 2 * np.pi * k / length
            amplitude = np.sqrt(2 * spectrum_density("fra_4", quantity, w) * 2 * np.pi / length)
            by_hand += amplitude * np.cos(w * s + phases[k - 1])
        np.testing.assert_allclose(getattr(track, quantity), by_hand, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(track.s, s)


@pytest.mark.parametrize("name", list(SPECTRA))
def test_a_synthetic_track_has_the_standard_deviations_of_its_spectrum(name):
    track = synthetic_track(name, length=20_000.0, seed=2)
    bands = ((3.0, 25.0), (25.0, 70.0), (70.0, 150.0))
    expected = [spectrum_sd(name, "yw", *band) for band in bands]
    assert band_sd(track, bands) == pytest.approx(expected, rel=0.01)
    for quantity in ("phiw", "gauge"):
        expected_sd = spectrum_sd(name, quantity, 3, 150)
        assert float(getattr(track, quantity).std()) == pytest.approx(expected_sd, rel=0.01, abs=1e-15)


def test_two_kilometres_of_erri_b176_low_have_0714_1197_1539_mm():
    result = 1e3 * band_sd(synthetic_track("erri_b176_low", length=2000.0, seed=1))
    assert result == pytest.approx([0.714, 1.197, 1.539], rel=0.02)


def test_the_first_metres_are_eased_in_by_a_half_cosine():
    sharp = synthetic_track("erri_b176_low", seed=3, ease_in=0)
    eased = synthetic_track("erri_b176_low", seed=3, ease_in=2.6)
    rise = 0.5 * (1 - np.cos(np.pi * sharp.s[:26] / 2.6))
    np.testing.assert_allclose(eased.yw[:26], rise * sharp.yw[:26], rtol=1e-12)
    np.testing.assert_allclose(eased.phiw[:26], rise * sharp.phiw[:26], rtol=1e-12)
    np.testing.assert_array_equal(eased.yw[26:], sharp.yw[26:])
    assert eased.yw[0] == 0


def test_a_harmonic_keeps_its_phase_when_the_band_changes():
    wide = synthetic_track("erri_b176_low", seed=1, shortest=3, longest=150, ease_in=0)
    short = synthetic_track("erri_b176_low", seed=1, shortest=3, longest=24.9, ease_in=0)
    long = synthetic_track("erri_b176_low", seed=1, shortest=24.99, longest=150, ease_in=0)
    np.testing.assert_allclose(short.yw + long.yw, wide.yw, atol=1e-15)


def test_scale_multiplies_seed_changes_and_the_same_spec_is_the_same_track():
    one = synthetic_track("erri_b176_high", seed=4)
    assert synthetic_track("erri_b176_high", seed=4).sha256 == one.sha256
    assert synthetic_track("erri_b176_high", seed=5).sha256 != one.sha256
    np.testing.assert_allclose(
        synthetic_track("erri_b176_high", seed=4, scale=2.5).yw, 2.5 * one.yw, rtol=0, atol=1e-15
    )


def test_the_header_states_spectrum_sides_band_seed_and_zero_columns():
    header = "\n".join(synthetic_track("sncf_poor", seed=9).conventions)
    for word in (
        "SNCF",
        "one-sided",
        "per rad/m",
        "3 to 150 m",
        "seed=9",
        "phiw is zero",
        "gauge is zero",
        "2 to 40",
    ):
        assert word in header
    erri = "\n".join(synthetic_track("erri_b176_low").conventions)
    assert "gauge is zero" in erri and "phiw is zero" not in erri
    assert not np.any(synthetic_track("erri_b176_low").gauge)


def test_a_spec_is_read_with_its_defaults_and_written_back():
    spec = parse_spec("erri_b176_low length=2000 seed=1")
    assert spec == TrackSpec("erri_b176_low", 2000.0, 1, 0.1, 3.0, 150.0, 1.0)
    assert parse_spec(str(spec)) == spec
    assert parse_spec("fra_6") == TrackSpec("fra_6", 1000.0, 0)
    assert parse_spec("fra_6 length=1.5km spacing=250mm").spacing == 0.25
    large = parse_spec(f"fra_6 seed={2**63 + 1}")
    assert large.seed == 2**63 + 1 and parse_spec(str(large)) == large
    same = synthetic_track("erri_b176_low", length=2000.0, seed=1)
    assert spec.build().sha256 == same.sha256


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty"),
        ("erri_b176 length=100", "did you mean erri_b176"),
        ("fra_1 lenght=100", "did you mean length"),
        ("fra_1 length=100 length=200", "twice"),
        ("fra_1 length=long", "length=VALUE"),
        ("fra_1 length", "length=VALUE"),
        ("fra_1 seed=1m", "seed=VALUE, a whole number"),
        ("fra_1 seed=1.5", "seed"),
        ("fra_1 seed=-1", "seed"),
        ("fra_1 spacing=2", "0.05 to 1 m"),
        ("fra_1 length=-5", "length"),
        ("fra_1 length=1000 spacing=0.3", "length=999.9 or 1000.2"),
        ("fra_1 shortest=200", "below longest"),
        ("fra_1 shortest=0.15", "spacing=0.075"),
        ("fra_1 longest=1e400", "finite"),
        ("fra_1 length=1e9", "20,000,000"),
        ("fra_1 length=1e12", "20,000,000"),
        ("fra_1 length=1e308", "20,000,000"),
        ("fra_1 seed=1e999", "seed"),
        ("fra_1 scale=-1", "scale"),
        ("fra_1 length=1", "no wavelength"),
    ],
)
def test_a_faulty_spec_is_rejected_with_a_remedy(text, message):
    with pytest.raises(ValueError, match=message):
        parse_spec(text)


def test_noise_has_its_standard_deviation_and_nothing_below_its_wavelength():
    s = 0.2 * np.arange(50_000)
    noise = band_limited_noise(np.random.default_rng(1), s, 2e-5, 2.5)
    assert float(noise.std()) == pytest.approx(2e-5, rel=0.03)
    bands = band_sd(Track(s, noise), [(0.4, 2.45), (2.5, 5.0), (5.0, 50.0)])
    assert bands[0] < 0.02 * bands[1]
    # flat: 1/2.5 to 1/5 and 1/5 to 1/50 waves a metre of 1/2.5 in all
    assert bands[1:] == pytest.approx([2e-5 * np.sqrt(0.5), 2e-5 * np.sqrt(0.45)], rel=0.05)


def test_noise_at_uneven_locations_is_repeatable():
    rng = np.random.default_rng
    s = np.sort(rng(0).uniform(0, 800, 3000))
    one, again = (band_limited_noise(rng(7), s, 1e-4, 2.5) for _ in range(2))
    np.testing.assert_array_equal(one, again)
    assert float(one.std()) == pytest.approx(1e-4, rel=0.15)
    assert not np.any(band_limited_noise(rng(7), s, 0.0, 2.5))


def test_noise_rejects_a_wavelength_of_zero():
    with pytest.raises(ValueError, match="wavelength"):
        band_limited_noise(np.random.default_rng(0), np.arange(5.0), 1.0, 0.0)


def test_the_seed_of_a_computed_track_cannot_be_replaced() -> None:
    source = resolve_track("erri_b176_low length=200 seed=1")
    with pytest.raises(ValueError, match="has its seed 1 already"):
        resolve_track(source, seed=2)
    with pytest.raises(ValueError, match="it has no seed"):
        resolve_track(source.track, seed=2)
