"""Weightings: published values, the brick wall and its streaming form, exactness between samples."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from railui.dsp.discretise import discretise
from railui.ride_quality.weighting import (
    COMFORT_WEIGHTS,
    SPERLING_B,
    W_1974,
    W_D,
    W_K,
    AnalogFilter,
    brick_wall_1974,
    cascade,
    comfort_cascades,
    sperling_b,
    transmissibility,
    weighted_rms,
)

FLOOR = transmissibility(1.2, 0.2)


def held_response(weight: AnalogFilter, frequency: np.ndarray, dt: float) -> np.ndarray:
    """Return a response sampled with input linear between samples: aliases under a sinc^2."""
    aliases = frequency[:, None] + np.arange(-20000, 20001) / dt
    return np.sum(weight.response(aliases) * np.sinc(aliases * dt) ** 2, axis=1)


def decibels(weight: AnalogFilter, frequency: float, dt: float) -> float:
    """Return the deviation of the streaming form of a weighting at one frequency [Hz]."""
    response = signal.freqz_sos(discretise(weight, dt), [2 * np.pi * frequency * dt])[1]
    return float(20 * np.log10(np.abs(response[0]) / weight.modulus(frequency)))


def test_w_d_has_the_values_of_iso_2631_1():
    frequency = np.array([1, 2, 4, 8, 16, 31.5])
    np.testing.assert_allclose(
        W_D.modulus(frequency), np.array([1011, 890, 512, 253, 125, 63.2]) / 1000, rtol=0, atol=5.1e-4
    )


def test_w_d_at_10_hz_is_what_the_filter_gives_and_not_the_misprint():
    # by hand: band limits are 1 at 10 Hz within 1e-4, (1 + 5j)/(1 + 5j/0.63 - 25)
    transition = abs((1 + 5j) / (1 + 5j / 0.63 - 25))
    assert transition == pytest.approx(0.2017, abs=5e-5)
    assert float(W_D.modulus(10.0)) == pytest.approx(0.2017, abs=5e-5)
    assert abs(float(W_D.modulus(10.0)) - 0.212) > 0.01


def test_w_k_has_the_values_of_iso_2631_1():
    np.testing.assert_allclose(W_K.modulus([1, 4, 8, 16]), np.array([482, 967, 1036, 768]) / 1000, rtol=0, atol=8e-4)


def test_the_floor_has_the_transmissibility_of_its_formula():
    for frequency in (0.3, 1.2, 5.0):
        s, w0, z = 2j * np.pi * frequency, 2 * np.pi * 1.2, 0.2
        by_hand = (2 * z * w0 * s + w0**2) / (s**2 + 2 * z * w0 * s + w0**2)
        assert complex(FLOOR.response(frequency)) == pytest.approx(by_hand, rel=1e-12)


def test_sperlings_b_is_the_modulus_of_a_rational_function_of_third_order():
    frequency = np.geomspace(0.05, 200, 500)
    assert SPERLING_B.poles.size == 3
    np.testing.assert_allclose(SPERLING_B.modulus(frequency), sperling_b(frequency), rtol=1e-12)
    # by hand at 5 Hz: 0.737 sqrt((47.775 + 39.0625)/(35.105625 + 10.336225))
    assert float(sperling_b(5.0)) == pytest.approx(0.737 * np.sqrt(86.8375 / 45.44185), rel=1e-9)


def test_the_brick_wall_of_the_1970s_is_0_then_1_then_2_over_f_then_0():
    frequency = [0.5, 0.999, 1.0, 1.5, 2.0, 4.0, 20.0, 80.0, 80.1]
    np.testing.assert_allclose(brick_wall_1974(frequency), [0, 0, 1, 1, 1, 0.5, 0.1, 0.025, 0], rtol=1e-15)


def test_the_streaming_form_of_the_1970s_differs_as_its_docstring_states():
    frequency = np.array([1, 1.25, 1.5, 2, 3, 4, 8, 16, 31.5, 63, 80])
    off = 20 * np.log10(W_1974.modulus(frequency) / brick_wall_1974(frequency))
    np.testing.assert_allclose(off, [-1.96, -0.41, 0.04, -0.58, 0.21, 0.24, 0.09, 0.02, -0.10, -1.41, -3.01], atol=0.01)


@pytest.mark.parametrize("before", [np.ones_like, lambda f: FLOOR.modulus(f) ** 2], ids=["white", "on the floor"])
def test_the_rms_of_the_streaming_form_agrees_within_2_percent(before):
    frequency = np.arange(0.005, 400, 0.005)
    power = before(frequency)
    streaming = np.sum(W_1974.modulus(frequency) ** 2 * power)
    wall = np.sum(brick_wall_1974(frequency) ** 2 * power)
    assert np.sqrt(streaming / wall) == pytest.approx(1.0, abs=0.02)


def test_w_d_at_400_hz_is_005_db_low_at_16_hz_and_029_at_40():
    assert decibels(W_D, 16.0, 1 / 400) == pytest.approx(-0.05, abs=0.005)
    assert decibels(W_D, 40.0, 1 / 400) == pytest.approx(-0.29, abs=0.005)


def test_a_bilinear_filter_at_200_hz_would_be_17_db_low_at_80_hz():
    bilinear = signal.bilinear_zpk(W_D.zeros, W_D.poles, W_D.gain, 200)
    response = signal.freqz_zpk(*bilinear, [80.0], fs=200)[1]
    assert 20 * np.log10(abs(response[0]) / W_D.modulus(80.0)) < -17
    assert decibels(W_D, 80.0, 1 / 200) > -7


def test_one_pole_is_discretised_as_by_hand():
    # x' = -x + u, u from u0 to u1 over h: x1 = E x0 + (u0 (1 - E - hE) + u1 (h - 1 + E))/h
    h, decay = 0.3, np.exp(-0.3)
    by_hand = [(h - 1 + decay) / h, (1 - decay - h * decay) / h, 0, 1, -decay, 0]
    np.testing.assert_allclose(discretise(([], [-1.0], 1.0), h), [by_hand], rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("dt", [0.0005, 0.0025, 0.005, 0.01])
@pytest.mark.parametrize("name", list(COMFORT_WEIGHTS))
def test_the_whole_cascade_is_exact_for_input_linear_between_samples(name, dt):
    weight = cascade(FLOOR, COMFORT_WEIGHTS[name])
    frequency = np.array([0.1, 0.4, 1, 2, 4, 8, 16, 40])
    response = signal.freqz_sos(discretise(weight, dt), 2 * np.pi * frequency * dt)[1]
    expected = held_response(weight, frequency, dt)
    np.testing.assert_allclose(response, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


@settings(max_examples=40, deadline=None)
@given(
    floor=st.tuples(st.floats(0.4, 6), st.floats(0.02, 1.5)),
    cushion=st.tuples(st.floats(1, 20), st.floats(0.05, 1.5)),
    alike=st.booleans(),
    dt=st.floats(0.0005, 0.02),
    name=st.sampled_from(list(COMFORT_WEIGHTS)),
)
def test_sections_are_exact_for_any_floor_and_cushion_even_equal_ones(floor, cushion, alike, dt, name):
    cushion = floor if alike else cushion
    weight = cascade(transmissibility(*floor), transmissibility(*cushion), COMFORT_WEIGHTS[name])
    frequency = np.array([0.5, 1.0, 3.0, 10.0])
    response = signal.freqz_sos(discretise(weight, dt), 2 * np.pi * frequency * dt)[1]
    expected = held_response(weight, frequency, dt)
    np.testing.assert_allclose(response, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_streaming_a_long_record_keeps_ten_digits():
    dt, rng = 0.0005, np.random.default_rng(1)
    x = np.cumsum(rng.standard_normal(40000)) * 0.01
    weight = cascade(FLOOR, W_D)
    streamed = signal.sosfilt(discretise(weight, dt), x)[:8000]
    # the residues of the poles, one exact recursion each: x1 = E x0 + h ((phi1 - phi2) u0 + phi2 u1)
    expected = np.zeros(8000, dtype=complex)
    for i, p in enumerate(weight.poles):
        residue = weight.gain * np.prod(p - weight.zeros) / np.prod(p - np.delete(weight.poles, i))
        turn = p * dt
        phi1 = np.expm1(turn) / turn
        phi2 = sum(turn**k / float(np.prod(np.arange(1.0, k + 3))) for k in range(25))
        drive = np.concatenate([[phi2 * x[0]], (phi1 - phi2) * x[:7999] + phi2 * x[1:8000]])
        expected += residue * dt * signal.lfilter([1.0], [1.0, -np.exp(turn)], drive)
    assert np.max(np.abs(streamed - expected.real)) < 1e-9 * np.max(np.abs(expected))


def test_a_constant_acceleration_dies_away_to_nothing():
    constant = np.ones(200_000)
    for weight in (W_D, W_1974, SPERLING_B):
        assert abs(signal.sosfilt(discretise(weight, 0.0025), constant)[-1]) < 1e-10


def test_an_unstable_or_improper_filter_is_rejected():
    with pytest.raises(ValueError, match="stable"):
        discretise(([], [1.0], 1.0), 0.01)
    with pytest.raises(ValueError, match="stable"):
        discretise(([0.0, 0.0], [-1.0], 1.0), 0.01)
    with pytest.raises(ValueError, match="positive"):
        discretise(W_D, 0.0)


def test_the_rms_of_a_sine_in_the_frequency_domain_is_weighted():
    """Over 20 s the start and end of the filtered record count little."""
    t = np.arange(8000) / 400
    for frequency in (1.0, 2.0, 10.0):
        sine = 0.3 * np.sqrt(2) * np.sin(2 * np.pi * frequency * t)
        for weight, modulus in ((W_D, W_D.modulus), (sperling_b, sperling_b)):
            by_hand = 0.3 * float(modulus(frequency))
            assert weighted_rms(sine, 1 / 400, weight) == pytest.approx(by_hand, rel=0.01)


def test_the_unweighted_rms_includes_the_mean():
    for n in (999, 1000):
        x = 2 + np.random.default_rng(n).standard_normal(n)
        assert weighted_rms(x, 0.01, np.ones_like) == pytest.approx(float(np.sqrt(np.mean(x**2))), rel=1e-12)


def test_the_streamed_rms_agrees_with_that_in_the_frequency_domain():
    rng, dt = np.random.default_rng(3), 1 / 400
    band = signal.butter(2, [0.5, 15], "bandpass", fs=400, output="sos")
    coloured = signal.sosfilt(band, rng.standard_normal(80_000))
    for weight in (W_D, W_K, W_1974, SPERLING_B):
        streamed = signal.sosfilt(discretise(weight, dt), coloured)
        assert np.sqrt(np.mean(streamed**2)) == pytest.approx(weighted_rms(coloured, dt, weight), rel=0.01)


def riding(**more):
    point = {"floor_frequency": 1.2, "floor_damping": 0.2, "cushion_frequency": None, "cushion_damping": None}
    return SimpleNamespace(**(point | more))


def test_the_comfort_point_is_in_series_with_floor_and_cushion():
    dt, frequency = 0.0025, 3.0
    plain = comfort_cascades(riding(), dt, floor=False)["weighted_acceleration"]
    floor = comfort_cascades(riding(), dt)["weighted_acceleration"]
    seat = comfort_cascades(riding(cushion_frequency=4.0, cushion_damping=0.3), dt)["weighted_acceleration"]
    at = [abs(signal.freqz_sos(sos, 2 * np.pi * frequency * dt)[1]) for sos in (plain, floor, seat)]
    assert at[1] / at[0] == pytest.approx(float(FLOOR.modulus(frequency)), rel=1e-3)
    assert at[2] / at[1] == pytest.approx(float(transmissibility(4.0, 0.3).modulus(frequency)), rel=1e-3)


def test_sections_are_computed_once_and_read_only():
    first, again = comfort_cascades(riding(), 0.003), comfort_cascades(riding(), 0.003)
    assert all(first[name] is again[name] for name in first)
    with pytest.raises(ValueError, match="read-only"):
        first["wz"][0, 0] = 1.0


def test_an_incomplete_cushion_is_rejected():
    with pytest.raises(ValueError, match="cushion_damping"):
        comfort_cascades(riding(cushion_frequency=4.0), 0.0025)
    with pytest.raises(ValueError, match="positive"):
        comfort_cascades(riding(floor_damping=0.0), 0.0025)
