"""Spectral densities, correlation and coherence against scipy.signal."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from railui.dsp.spectra import coherence, correlate, csd, detrend, hann, periodogram, tukey, welch

RATE = 400.0
NOISE = np.random.default_rng(3).standard_normal((3, 4000))


@pytest.mark.parametrize("n", [1000, 999, 4000])
def test_power_densities_agree_with_scipy(n: int) -> None:
    f, result = welch(NOISE[2], RATE, n)
    at, theirs = signal.welch(NOISE[2], RATE, nperseg=n)
    assert np.array_equal(f, at)
    np.testing.assert_allclose(result, theirs, rtol=1e-10, atol=1e-20)
    assert np.array_equal(welch(NOISE[2], RATE, 9000)[1], welch(NOISE[2], RATE, 4000)[1])


@pytest.mark.parametrize("n", [1000, 999, 4000])
def test_cross_densities_and_periodograms_agree_with_scipy(n: int) -> None:
    x, y = NOISE[0], NOISE[0] + 0.3 * np.roll(NOISE[1], 7)
    f, result = csd(x, y, RATE, n)
    at, theirs = signal.csd(x, y, RATE, nperseg=n)
    assert np.array_equal(f, at)
    np.testing.assert_allclose(hann(n), signal.windows.hann(n, sym=False), rtol=0, atol=1e-15)
    np.testing.assert_allclose(result, theirs, rtol=1e-9, atol=1e-12)
    f, power = periodogram(x[:n], RATE)
    at, theirs = signal.periodogram(x[:n], RATE)
    assert np.array_equal(f, at)
    np.testing.assert_allclose(power, theirs, rtol=1e-10, atol=1e-20)


def test_detrended_series_agree_with_scipy() -> None:
    x = NOISE + 3.0 + 0.01 * np.arange(4000)
    np.testing.assert_allclose(detrend(x), signal.detrend(x), rtol=0, atol=1e-12)


@pytest.mark.parametrize("n", [1000, 999])
def test_power_densities_of_detrended_segments_agree_with_scipy(n: int) -> None:
    x = NOISE[0] + 0.01 * np.arange(4000)
    theirs = signal.welch(x, RATE, nperseg=n, detrend=signal.detrend)[1]
    np.testing.assert_allclose(welch(x, RATE, n, "line")[1], theirs, rtol=1e-9, atol=1e-20)


@pytest.mark.parametrize("n", [1000, 999])
def test_coherence_agrees_with_scipy(n: int) -> None:
    x, y = NOISE[0], NOISE[0] + 0.3 * NOISE[1]
    f, ours = coherence(x, y, RATE, n)
    at, theirs = signal.coherence(x, y, RATE, nperseg=n)
    assert np.array_equal(f, at)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9)


@pytest.mark.parametrize(("n", "m"), [(1000, 777), (5, 1000), (1, 1)])
def test_correlations_agree_with_scipy(n: int, m: int) -> None:
    x, y = NOISE[0, :n], NOISE[1, :m]
    np.testing.assert_allclose(correlate(x, y), signal.correlate(x, y), rtol=0, atol=1e-12)


@pytest.mark.parametrize(("n", "share"), [(101, 1.0), (100, 0.05), (10, 0.3), (5, 0.0)])
def test_tukey_windows_agree_with_scipy(n: int, share: float) -> None:
    np.testing.assert_allclose(tukey(n, share), signal.windows.tukey(n, share), rtol=0, atol=1e-14)
