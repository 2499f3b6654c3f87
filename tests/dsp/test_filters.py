"""Butterworth filters against scipy.signal."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from railui.core import sosfilt
from railui.dsp.filters import butterworth, frequency_response, padlen, sosfilt_zi, sosfiltfilt

RATE = 400.0


EDGES = [[20.0], [0.1, 2.7], [3.0, 7.0], [60.0, 180.0]]


NOISE = np.random.default_rng(3).standard_normal((3, 4000))


def of_scipy(edges: list[float]) -> np.ndarray:
    kind = "low" if len(edges) == 1 else "bandpass"
    return signal.butter(4, np.squeeze(edges), kind, fs=RATE, output="sos")


def test_a_second_order_low_pass_agrees_with_its_formula() -> None:
    """tan(pi/4) = 1: H = (1 + 1/z)^2/(2 + sqrt 2 + (2 - sqrt 2)/z^2)."""
    b, a = 1.0 / (2.0 + np.sqrt(2.0)), (2.0 - np.sqrt(2.0)) / (2.0 + np.sqrt(2.0))
    assert butterworth(2, [25.0], 100.0) == pytest.approx(np.array([[b, 2 * b, b, 1.0, 0.0, a]]), abs=1e-15)


@pytest.mark.parametrize("edges", EDGES)
def test_a_butterworth_filter_has_the_response_of_scipy(edges: list[float]) -> None:
    f = np.geomspace(0.05, 199.0, 400)
    _, theirs = signal.freqz_sos(of_scipy(edges), f, fs=RATE)
    assert np.abs(frequency_response(butterworth(4, edges, RATE), 2 * np.pi * f / RATE) - theirs).max() < 1e-9


@pytest.mark.parametrize("edges", EDGES)
def test_zero_phase_filtering_agrees_with_scipy_up_to_both_ends(edges: list[float]) -> None:
    theirs = signal.sosfiltfilt(of_scipy(edges), NOISE)
    np.testing.assert_allclose(sosfiltfilt(butterworth(4, edges, RATE), NOISE), theirs, rtol=0, atol=1e-9)
    mirrored = signal.sosfiltfilt(of_scipy(edges), NOISE, padlen=padlen(of_scipy(edges)))
    assert np.array_equal(mirrored, theirs)


def test_filtered_series_are_those_of_scipy_bit_for_bit() -> None:
    sos = of_scipy([3.0, 7.0])
    memory = NOISE[:, :8].reshape(3, 4, 2)
    theirs, _ = signal.sosfilt(sos, NOISE, zi=memory.transpose(1, 0, 2))
    assert np.array_equal(sosfilt(sos, NOISE, memory), theirs)
    assert np.array_equal(sosfilt(sos, NOISE[0]), signal.sosfilt(sos, NOISE[0]))


def test_sections_in_their_steady_state_stay_there() -> None:
    sos = butterworth(4, [20.0], RATE)
    assert sosfilt_zi(sos) == pytest.approx(signal.sosfilt_zi(sos), abs=1e-12)
    assert sosfilt(sos, np.ones(500), sosfilt_zi(sos)) == pytest.approx(np.ones(500), abs=1e-11)


@pytest.mark.parametrize(("order", "edges"), [(0, [20.0]), (4, [200.0]), (4, [7.0, 3.0]), (4, [0.0, 3.0])])
def test_an_invalid_filter_is_rejected(order: int, edges: list[float]) -> None:
    with pytest.raises(ValueError, match="order of at least 1 and edges that increase between 0 and 200 Hz"):
        butterworth(order, edges, RATE)


@pytest.mark.parametrize(("order", "edges"), [(1, [20.0]), (3, [20.0]), (3, [3.0, 7.0]), (3, [1.0, 150.0])])
def test_filters_of_odd_order_agree_with_scipy(order: int, edges: list[float]) -> None:
    kind = "low" if len(edges) == 1 else "bandpass"
    sos = signal.butter(order, np.squeeze(edges), kind, fs=RATE, output="sos")
    ours = butterworth(order, edges, RATE)
    np.testing.assert_allclose(sosfiltfilt(ours, NOISE), signal.sosfiltfilt(sos, NOISE), rtol=0, atol=1e-9)
