"""Integration of what sensors read: once or twice, less what drifts, and zero-phase filters beside it."""

from __future__ import annotations

import numpy as np
from scipy import signal

from railui.arrays import FloatArray


def highpass_gain(frequency: FloatArray, natural: float, damping: float) -> FloatArray:
    """abs(H)^2 of H = s^2/(s^2 + 2 zeta w0 s + w0^2), the gain of the zero-phase form; frequencies [Hz]."""
    f = np.asarray(frequency, dtype=np.float64) ** 2
    return np.asarray(f**2 / ((f - natural**2) ** 2 + 4 * damping**2 * natural**2 * f))


def integrate(
    x: FloatArray, dt: float, times: int, natural: float, damping: float, zero_phase: bool = True
) -> FloatArray:
    """x [n] integrated 0, 1 or 2 `times` over t, less what is slower than `natural` [Hz].

    Zero phase: forward and backward through H = s^2/(s^2 + 2 zeta w0 s + w0^2), all integrations exact for what is
    below half the sampling rate. Causal: once through s^(2 - times)/(s^2 + 2 zeta w0 s + w0^2), exact for x linear
    between samples: the thesis' integrating filter (Broersen 1976, 6.1). Ends are wrong for about 3/(4 natural) s.

    >>> t = np.arange(4000) * 0.005
    >>> y = integrated(-((2 * np.pi) ** 2) * np.sin(2 * np.pi * t), 0.005, 2, 0.1, 0.7071)
    >>> bool(np.max(np.abs(y - np.sin(2 * np.pi * t))[1200:-1200]) < 2e-3)
    True
    """
    if not zero_phase:
        return _causal(x, dt, times, natural, damping)
    n, pad = x.size, min(round(6.0 / (natural * dt)), x.size - 1)
    ends, mean = np.zeros(1 << int(np.ceil(np.log2(n + 2 * pad)))), x - x.mean()
    # mirrored with the other sign at both ends: of zeros the filter would make five times the error there
    rise = 0.5 - 0.5 * np.cos(np.pi * np.arange(pad) / max(pad, 1))
    ends[: n + 2 * pad] = np.concatenate((-rise * mean[pad:0:-1], mean, -rise[::-1] * mean[-2 : -pad - 2 : -1]))
    frequency = np.asarray(np.fft.rfftfreq(ends.size, dt), dtype=np.float64)
    gain = highpass_gain(frequency, natural, damping).astype(complex)
    gain[1:] /= (2j * np.pi * frequency[1:]) ** times
    gain[0] = 0.0
    return np.asarray(np.fft.irfft(np.fft.rfft(ends) * gain, ends.size)[pad : pad + n])


def _causal(x: FloatArray, dt: float, times: int, natural: float, damping: float) -> FloatArray:
    w0 = 2 * np.pi * natural
    numerator = np.zeros(3)
    numerator[times] = 1.0
    b, a, _ = signal.cont2discrete((numerator, [1.0, 2 * damping * w0, w0**2]), dt, method="foh")
    start = x[0] if times == 0 else 0.0
    return np.asarray(signal.lfilter(b.ravel(), a, x - start), dtype=np.float64)


def lowpass(x: FloatArray, dt: float, corner: float) -> FloatArray:
    """x less what is faster than `corner` [Hz]: a Butterworth of sixth order, forward and backward."""
    if corner >= 0.45 / dt:
        return x
    return np.asarray(signal.sosfiltfilt(signal.butter(6, corner, fs=1 / dt, output="sos"), x))


def delay(x: FloatArray, dt: float, delay: float) -> FloatArray:
    """x as it was `delay` [s] earlier than it was read: sensors and filters that lag, mended; ends are held."""
    if delay == 0.0:
        return x
    from scipy.interpolate import CubicSpline

    n = x.size
    at = np.clip(np.arange(n) + delay / dt, 0, n - 1)
    return np.asarray(CubicSpline(np.arange(n), x)(at))
