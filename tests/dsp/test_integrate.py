"""Integration of sensor signals, low-pass and delay compensation against formulas and scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal
from scipy.interpolate import CubicSpline

from railui.dsp.integrate import compensate_delay, integrate, lowpass

DT = 0.0025
NOISE = 0.1 * np.cumsum(np.random.default_rng(1).standard_normal(8000))


@pytest.mark.parametrize("times", [0, 1, 2])
@pytest.mark.parametrize("damping", [0.7071, 1.3])
def test_causal_integration_has_the_response_of_its_transfer_function(times: int, damping: float) -> None:
    """The state of s^(2 - times)/(s^2 + 2 zeta w0 s + w0^2) after a ramp, in closed form by its step response."""
    w0, t = 2 * np.pi * 0.5, DT * np.arange(4000)
    system = signal.lti(np.eye(3)[times][times:], [1.0, 2 * damping * w0, w0**2])
    _, exact, _ = signal.lsim(system, t, t)  # exact for input linear between samples
    assert integrate(t, DT, times, 0.5, damping, zero_phase=False) == pytest.approx(exact, abs=1e-8)


@pytest.mark.parametrize("corner", [5.0, 20.0, 150.0])
def test_the_low_pass_agrees_with_scipy(corner: float) -> None:
    theirs = signal.sosfiltfilt(signal.butter(6, corner, fs=1 / DT, output="sos"), NOISE)
    np.testing.assert_allclose(lowpass(NOISE, DT, corner), theirs, rtol=0, atol=1e-10)


def test_a_low_pass_near_half_the_sampling_rate_changes_nothing() -> None:
    assert lowpass(NOISE, DT, 190.0) is NOISE


def test_a_delay_is_compensated_by_the_spline() -> None:
    n = NOISE.size
    shifted = CubicSpline(np.arange(n), NOISE)(np.clip(np.arange(n) + 0.0013 / DT, 0, n - 1))
    np.testing.assert_allclose(compensate_delay(NOISE, DT, 0.0013), shifted, rtol=0, atol=1e-12)
