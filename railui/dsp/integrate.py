"""Integration of sensor signals without drift, low-pass filter and compensation of delays."""

from __future__ import annotations

import numpy as np

from railui.arrays import FloatArray
from railui.core import Spline, sosfilt
from railui.dsp.discretise import discretise
from railui.dsp.filters import butterworth, sosfiltfilt

PADDING_PERIODS = 6.0  # periods of the natural frequency by which both ends are extended
LOW_PASS_ORDER = 6
MAX_CORNER = 0.45  # share of the sampling rate from which a low-pass removes nothing


def highpass_gain(frequency: FloatArray, natural: float, damping: float) -> FloatArray:
    """Return abs(H)^2 of H = s^2/(s^2 + 2 zeta w0 s + w0^2), the gain of the zero-phase form; frequencies [Hz]."""
    f = np.asarray(frequency, dtype=np.float64) ** 2
    return np.asarray(f**2 / ((f - natural**2) ** 2 + 4 * damping**2 * natural**2 * f))


def integrate(
    x: FloatArray, dt: float, times: int, natural: float, damping: float, zero_phase: bool = True
) -> FloatArray:
    """Integrate a series over time 0, 1 or 2 times through a second-order high-pass that removes drift.

    Zero phase: forward and backward through H = s^2/(s^2 + 2 zeta w0 s + w0^2), all integrations exact below half the
    sampling rate. Causal: once through s^(2 - times)/(s^2 + 2 zeta w0 s + w0^2), exact for x linear between samples.
    Both ends are wrong over about 3/(4 natural) s.

    Parameters
    ----------
    x : FloatArray
        Series [n].
    dt : float
        Time between samples [s].
    times : int
        Number of integrations: 0, 1 or 2.
    natural : float
        Natural frequency of the high-pass [Hz].
    damping : float
        Damping ratio zeta of the high-pass.
    zero_phase : bool
        Zero-phase form; else the causal form.

    References
    ----------
    Broersen 1976, 6.1: the integrating filter (causal form).

    Examples
    --------
    >>> t = np.arange(4000) * 0.005
    >>> y = integrate(-((2 * np.pi) ** 2) * np.sin(2 * np.pi * t), 0.005, 2, 0.1, 0.7071)
    >>> bool(np.max(np.abs(y - np.sin(2 * np.pi * t))[1200:-1200]) < 2e-3)
    True
    """
    if not zero_phase:
        return _integrate_causally(x, dt, times, natural, damping)
    n, pad = x.size, min(round(PADDING_PERIODS / (natural * dt)), x.size - 1)
    mean_free = x - x.mean()
    padded = np.zeros(1 << int(np.ceil(np.log2(n + 2 * pad))))
    # ends mirrored with the opposite sign: zeros would make the error of the filter there five times as large
    rise = 0.5 - 0.5 * np.cos(np.pi * np.arange(pad) / max(pad, 1))
    start, end = -rise * mean_free[pad:0:-1], -rise[::-1] * mean_free[-2 : -pad - 2 : -1]
    padded[: n + 2 * pad] = np.concatenate((start, mean_free, end))
    frequency = np.asarray(np.fft.rfftfreq(padded.size, dt), dtype=np.float64)
    gain = highpass_gain(frequency, natural, damping).astype(complex)
    gain[1:] /= (2j * np.pi * frequency[1:]) ** times
    gain[0] = 0.0
    return np.asarray(np.fft.irfft(np.fft.rfft(padded) * gain, padded.size)[pad : pad + n])


def _integrate_causally(x: FloatArray, dt: float, times: int, natural: float, damping: float) -> FloatArray:
    w0 = 2 * np.pi * natural
    poles = np.roots([1.0, 2 * damping * w0, w0**2])
    sections = discretise((np.zeros(2 - times), poles, 1.0), dt)
    offset = x[0] if times == 0 else 0.0
    return sosfilt(sections, x - offset)


def lowpass(x: FloatArray, dt: float, corner: float) -> FloatArray:
    """Low-pass a series [n] at a corner frequency [Hz] by a sixth-order Butterworth filter with zero phase."""
    if corner >= MAX_CORNER / dt:
        return x
    return sosfiltfilt(butterworth(LOW_PASS_ORDER, [corner], 1 / dt), x)


def compensate_delay(x: FloatArray, dt: float, delay: float) -> FloatArray:
    """Shift a series [n] to `delay` [s] earlier by its cubic spline; beyond the ends it keeps its last value."""
    if delay == 0.0:
        return x
    sample = np.arange(x.size, dtype=np.float64)
    return Spline(sample, x)(np.clip(sample + delay / dt, 0, x.size - 1))
