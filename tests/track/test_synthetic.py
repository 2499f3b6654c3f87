"""Track: published spectra and their standard deviations, synthetic lines, splines and input tables."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from railui.core import Spline
from railui.track import (
    COLUMNS,
    SPECTRA,
    Track,
    TrackSpec,
    band_limited_noise,
    band_sd,
    distance_from_speed,
    equally_spaced,
    input_table,
    nearest_spectrum,
    parse_spec,
    psd,
    run_table,
    spectrum_density,
    spectrum_sd,
    synthetic_track,
    track_table,
    add_track,
)

# --- spectra


@pytest.mark.parametrize(
    ("name", "expected"),
    [("erri_b176_low", (0.714, 1.197, 1.539, 1.696)), ("erri_b176_high", (1.213, 2.035, 2.616, 2.883))],
)
def test_erri_b176_has_the_standard_deviations_worked_out_for_it(name, expected):
    bands = ((3, 25), (25, 70), (70, 150), (2, 100))
    found = [1e3 * spectrum_sd(name, "yw", *band) for band in bands]
    assert found == pytest.approx(expected, abs=6e-4)


@pytest.mark.parametrize("wavelength", [3.0, 17.0, 150.0])
def test_erri_b176_is_its_formula(wavelength):
    w = 2 * np.pi / wavelength
    wc2, wr2, ws2 = 0.8246**2, 0.0206**2, 0.4380**2
    lateral = {"low": 2.119e-7, "high": 6.125e-7}
    vertical = {"low": 4.032e-7, "high": 1.080e-6}
    for level in ("low", "high"):
        yw = lateral[level] * wc2 / ((w**2 + wr2) * (w**2 + wc2))
        phiw = vertical[level] / 0.75**2 * wc2 * w**2 / ((w**2 + wr2) * (w**2 + wc2) * (w**2 + ws2))
        found = [float(spectrum_density(f"erri_b176_{level}", q, w)) for q in ("yw", "phiw", "gauge")]
        assert found == pytest.approx([yw, phiw, 0.0], rel=1e-12)


@pytest.mark.parametrize("number", [1, 2, 3, 4, 5, 6])
def test_fra_classes_are_their_formula_with_cross_level_as_height_over_2b(number):
    lateral = [3.3634, 1.2107, 0.4128, 0.3027, 0.0762, 0.0339][number - 1]
    vertical = [1.2107, 1.0181, 0.6816, 0.5376, 0.2095, 0.0339][number - 1]
    ws = [0.6046, 0.9308, 0.8520, 1.1312, 0.8209, 0.4380][number - 1]
    w, wc = 0.3, 0.8245
    yw = 0.25 * lateral * 1e-4 * wc**2 / (w**2 * (w**2 + wc**2))
    height = 4 * 0.25 * vertical * 1e-4 * wc**2 / ((w**2 + wc**2) * (w**2 + ws**2))
    found = [float(spectrum_density(f"fra_{number}", q, w)) for q in ("yw", "phiw", "gauge")]
    assert found == pytest.approx([yw, height / 1.5**2, height], rel=1e-12)


@pytest.mark.parametrize(("name", "factor"), [("sncf_good", 0.509), ("sncf_poor", 1.790)])
def test_sncf_is_a_density_per_cycle_turned_into_one_per_radian(name, factor):
    n = 0.1  # 1/m
    per_cycle = factor * 308e-6 / (1 + n / 0.0489) ** 3
    assert float(spectrum_density(name, "yw", 2 * np.pi * n)) == pytest.approx(per_cycle / (2 * np.pi), rel=1e-12)


def test_an_unknown_spectrum_names_the_nearest():
    with pytest.raises(ValueError, match="did you mean erri_b176_low"):
        synthetic_track("erri_b167_low")
    with pytest.raises(ValueError, match="no track quantity"):
        spectrum_density("fra_1", "twist", 1.0)


# --- synthetic track


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
    found = 1e3 * band_sd(synthetic_track("erri_b176_low", length=2000.0, seed=1))
    assert found == pytest.approx([0.714, 1.197, 1.539], rel=0.02)


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


def test_the_header_says_spectrum_sides_band_seed_and_what_is_zero():
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
def test_a_wrong_spec_says_what_to_write(text, message):
    with pytest.raises(ValueError, match=message):
        parse_spec(text)


# --- what a track contains


def test_the_spectrum_of_a_track_is_the_one_that_it_was_made_of():
    found = psd(synthetic_track("fra_4", length=50_000.0, seed=1))
    inside = (found.wavenumber > 2 * np.pi / 100) & (found.wavenumber < 2 * np.pi / 4)
    for quantity in ("yw", "phiw", "gauge"):
        ratio = getattr(found, quantity)[inside] / spectrum_density("fra_4", quantity, found.wavenumber[inside])
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
def test_a_track_is_nearest_to_its_own_spectrum(name):
    found = nearest_spectrum(synthetic_track(name, length=5000.0, seed=6))
    assert found is not None and found.name == name
    assert found.factor == pytest.approx(1.0, abs=0.02)


def test_a_flat_track_is_near_to_none():
    assert nearest_spectrum(Track(np.arange(100) * 0.1, np.zeros(100))) is None


# --- the track itself


def test_a_track_must_be_equally_spaced_finite_and_complete():
    s = np.arange(10) * 0.1
    with pytest.raises(ValueError, match="equally spaced"):
        Track(np.where(s > 0.5, s + 0.05, s), s)
    with pytest.raises(ValueError, match="yw is not finite at sample 3"):
        Track(s, np.where(np.arange(10) == 3, np.nan, s))
    with pytest.raises(ValueError, match="shape"):
        Track(s, s[:9])
    with pytest.raises(ValueError, match="4 samples"):
        Track(s[:3], s[:3])


def test_a_track_cannot_be_written_over():
    track = synthetic_track("fra_6")
    with pytest.raises(ValueError, match="read-only"):
        track.yw[0] = 1.0


def test_a_run_laid_anew_passes_through_the_spline_of_its_samples():
    rng = np.random.default_rng(0)
    s = np.cumsum(rng.uniform(0.1, 0.3, 500))
    track = equally_spaced(s, np.sin(s / 3), np.cos(s / 5), spacing=0.2)
    np.testing.assert_allclose(track.yw, np.sin(track.s / 3), atol=1e-4)
    np.testing.assert_allclose(track.phiw, np.cos(track.s / 5), atol=1e-4)
    assert not np.any(track.gauge) and track.spacing == pytest.approx(0.2)


# --- input tables


def test_the_table_has_the_columns_of_the_kernel():
    assert (
        *("s", "v", "yw1", "dyw1", "phiw1", "dphiw1", "gauge1"),
        *("yw2", "dyw2", "phiw2", "dphiw2", "gauge2", "Qy", "Qpsi"),
    ) == COLUMNS


@pytest.mark.parametrize("steps", [1, 2, 8])
def test_a_track_at_constant_speed_is_its_spline_at_half_steps_for_both_wheelsets(steps):
    track = synthetic_track("fra_4", length=100.0, seed=1)
    table, dt = track_table(track, 40.0, 1.25, steps)
    assert table.shape == (2 * steps * 999 + 1, 14) and table.flags.c_contiguous and table.dtype == np.float64
    assert dt == pytest.approx(0.0025)
    place = 0.1 * np.arange(2 * steps * 999 + 1) / (2 * steps)
    np.testing.assert_allclose(table[:, 0], place, atol=1e-12)
    assert np.all(table[:, 1] == 40.0) and not np.any(table[:, 12:])
    behind = place - 2.5
    moving = behind > 1e-6
    held = behind < -1e-6
    for at, column in ((0, track.yw), (2, track.phiw), (4, track.gauge)):
        spline = CubicSpline(track.s, column)
        np.testing.assert_allclose(table[:, 2 + at], spline(place), atol=1e-13)
        np.testing.assert_allclose(table[moving, 7 + at], spline(behind[moving]), atol=1e-13)
        np.testing.assert_array_equal(table[held, 7 + at], column[0])
        if at < 4:
            np.testing.assert_allclose(table[:, 3 + at], spline(place, 1), atol=1e-12)
            np.testing.assert_allclose(table[moving, 8 + at], spline(behind[moving], 1), atol=1e-12)
            assert not np.any(table[held, 8 + at])


def test_samples_stand_in_the_table_to_the_last_digit():
    track = synthetic_track("fra_4", length=200.0)
    table, _ = track_table(track, 30.0, 1.28, 2)
    np.testing.assert_array_equal(table[::4, 0], track.s)
    np.testing.assert_allclose(table[::4, 2], track.yw, rtol=0, atol=1e-17)


def test_the_trailing_wheelset_meets_the_track_one_wheelbase_later():
    track = synthetic_track("erri_b176_high", length=100.0, seed=2)
    table, _ = track_table(track, 25.0, 1.25, 1)  # 2.5 m are 50 half steps
    np.testing.assert_allclose(table[51:, 7:12], table[1:-50, 2:7], atol=1e-12)


def test_a_run_of_changing_speed_reads_the_track_where_the_wheelset_is():
    t = np.arange(2001) / 200
    place = 30 * t + 2 * t**2 - 0.1 * t**3
    speed = 30 + 4 * t - 0.3 * t**2
    columns = {
        "t": t,
        "s": place,
        "v": speed,
        "yw": 1e-3 * np.sin(place / 4),
        "phiw": 1e-3 * np.cos(place / 6),
    }
    columns |= {"gauge": 1e-3 * np.sin(place / 9), "Qy": 1e3 * np.sin(3 * t), "Qpsi": 1e3 * np.cos(2 * t)}
    table, dt = run_table(columns, half_wheelbase=1.3, steps=4)
    at = np.arange(8 * 2000 + 1) / 1600
    s = 30 * at + 2 * at**2 - 0.1 * at**3
    behind = s - 2.6
    assert dt == pytest.approx(0.005)
    np.testing.assert_allclose(table[:, 0], s, atol=1e-9)
    np.testing.assert_allclose(table[:, 1], 30 + 4 * at - 0.3 * at**2, atol=1e-9)
    inner = slice(200, -200)  # away from the ends of the splines
    by_hand = [
        *(np.sin(s / 4), np.cos(s / 4) / 4, np.cos(s / 6), -np.sin(s / 6) / 6, np.sin(s / 9)),
        *(
            np.sin(behind / 4),
            np.cos(behind / 4) / 4,
            np.cos(behind / 6),
            -np.sin(behind / 6) / 6,
            np.sin(behind / 9),
        ),
    ]
    for column, expected in enumerate(by_hand, start=2):
        np.testing.assert_allclose(table[inner, column], 1e-3 * expected[inner], atol=2e-9)
    np.testing.assert_allclose(table[:, 12], 1e3 * np.sin(3 * at), atol=1e-5)
    np.testing.assert_allclose(table[:, 13], 1e3 * np.cos(2 * at), atol=1e-5)


def test_distance_left_out_is_the_integral_of_the_speed():
    t = np.arange(1001) / 100
    v = 20 + 5 * np.sin(t)
    np.testing.assert_allclose(distance_from_speed(t, v), 20 * t + 5 * (1 - np.cos(t)), atol=1e-8)
    bare, _ = run_table({"t": t, "v": v, "yw": 1e-3 * np.sin(t)}, 1.28, 1)
    full, _ = run_table({"t": t, "v": v, "s": distance_from_speed(t, v), "yw": 1e-3 * np.sin(t)}, 1.28, 1)
    np.testing.assert_array_equal(bare, full)


@settings(max_examples=25, deadline=None)
@given(st.floats(1, 120), st.floats(0.5, 2), st.sampled_from([1, 2, 4]), st.floats(0.05, 1))
def test_a_run_at_constant_speed_is_the_track_at_that_speed(speed, half_wheelbase, steps, spacing):
    s = spacing * np.arange(60)
    yw = 1e-3 * np.sin(np.arange(60.0))
    from_track, dt = track_table(Track(s, yw), speed, half_wheelbase, steps)
    from_run, run_dt = run_table({"t": s / speed, "v": np.full(60, speed), "s": s, "yw": yw}, half_wheelbase, steps)
    assert dt == pytest.approx(run_dt)
    np.testing.assert_allclose(from_run, from_track, atol=1e-9)


def test_a_table_refuses_what_cannot_drive_a_vehicle():
    t = np.arange(10) * 0.01
    s, v, yw = 30 * t, np.full(10, 30.0), np.zeros(10)
    with pytest.raises(ValueError, match="power of two: 3"):
        input_table(t, s, v, yw, None, None, 1.28, 3)
    with pytest.raises(ValueError, match="distance must increase"):
        input_table(t, np.where(t > 0.05, 1.5, s), v, yw, None, None, 1.28, 1)
    with pytest.raises(ValueError, match="time must increase"):
        input_table(t[::-1], s, v, yw, None, None, 1.28, 1)
    with pytest.raises(ValueError, match="column v has shape"):
        input_table(t, s, v[:9], yw, None, None, 1.28, 1)
    with pytest.raises(ValueError, match="column yw is not finite at sample 4"):
        input_table(t, s, v, np.where(np.arange(10) == 4, np.nan, yw), None, None, 1.28, 1)
    with pytest.raises(ValueError, match="yw missing"):
        run_table({"t": t, "v": v}, 1.28, 1)
    with pytest.raises(ValueError, match="speed must be positive"):
        track_table(Track(s, yw), 0.0, 1.28, 1)


# --- noise of track columns


def test_noise_has_its_standard_deviation_and_nothing_below_its_wavelength():
    s = 0.2 * np.arange(50_000)
    noise = band_limited_noise(np.random.default_rng(1), s, 2e-5, 2.5)
    assert float(noise.std()) == pytest.approx(2e-5, rel=0.03)
    bands = band_sd(Track(s, noise), [(0.4, 2.45), (2.5, 5.0), (5.0, 50.0)])
    assert bands[0] < 0.02 * bands[1]
    # flat: 1/2.5 to 1/5 and 1/5 to 1/50 waves a metre of 1/2.5 in all
    assert bands[1:] == pytest.approx([2e-5 * np.sqrt(0.5), 2e-5 * np.sqrt(0.45)], rel=0.05)


def test_noise_may_be_asked_at_uneven_places_and_is_repeatable():
    rng = np.random.default_rng
    s = np.sort(rng(0).uniform(0, 800, 3000))
    one, again = (band_limited_noise(rng(7), s, 1e-4, 2.5) for _ in range(2))
    np.testing.assert_array_equal(one, again)
    assert float(one.std()) == pytest.approx(1e-4, rel=0.15)
    assert not np.any(band_limited_noise(rng(7), s, 0.0, 2.5))


def test_noise_refuses_a_wavelength_of_nothing():
    with pytest.raises(ValueError, match="wavelength"):
        band_limited_noise(np.random.default_rng(0), np.arange(5.0), 1.0, 0.0)


def test_noise_laid_upon_a_table_is_the_table_of_the_sum():
    rng = np.random.default_rng(5)
    t = np.arange(60) * 0.01
    v = 30.0 + np.sin(t)
    s = 30.0 * t + 1.0 - np.cos(t)
    track, noise = rng.standard_normal((2, 3, 60))
    both = input_table(t, s, v, *(track + noise), 1.25, 2)
    laid = add_track(input_table(t, s, v, *track, 1.25, 2), s, list(noise), 1.25)
    assert np.allclose(laid, both, rtol=1e-9, atol=1e-9)


def test_a_spline_through_even_places_has_scipys_digits() -> None:
    x = 0.1 * np.arange(2000)
    y = np.random.default_rng(1).standard_normal((2000, 3))
    at = np.random.default_rng(2).uniform(-1.0, 201.0, 3000)
    ours, theirs = Spline(x, y), CubicSpline(x, y)
    for found in (at, np.sort(at), x):
        assert np.array_equal(ours(found), theirs(found))
        assert np.array_equal(ours(found, 1), theirs(found, 1))
    assert np.array_equal(ours.coefficients, theirs.c.transpose(2, 0, 1))


def test_a_spline_through_uneven_places_is_scipys_to_rounding() -> None:
    x = np.cumsum(np.random.default_rng(3).uniform(0.01, 1.0, 2000))
    y = np.random.default_rng(1).standard_normal(2000)
    at = np.linspace(x[0] - 0.1, x[-1] + 0.1, 3000)
    for order in (0, 1, 2):
        theirs = CubicSpline(x, y)(at, order)
        assert np.abs(Spline(x, y)(at, order) - theirs).max() < 1e-12 * np.abs(theirs).max()


def test_a_distance_is_the_integral_of_the_spline_of_speed() -> None:
    t = np.cumsum(np.random.default_rng(4).uniform(0.01, 0.02, 4000))
    v = 40.0 + 3.0 * np.sin(t)
    assert distance_from_speed(t, v) == pytest.approx(CubicSpline(t, v).antiderivative()(t), rel=1e-13, abs=1e-9)


def test_a_spline_tells_what_it_cannot_pass_through() -> None:
    with pytest.raises(ValueError, match="samples of a spline: 3 given, 4 expected"):
        Spline(np.arange(3.0), np.zeros(3))
    with pytest.raises(ValueError, match="the step to place 2 of a spline is 0"):
        Spline(np.array([0.0, 1.0, 1.0, 2.0]), np.zeros(4))
