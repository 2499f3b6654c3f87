"""Power of series over frequency, as scipy.signal has it, which takes half a second to read."""

from __future__ import annotations

from typing import Any

import numpy as np

from railui.arrays import ComplexArray, FloatArray


def detrend(x: FloatArray) -> FloatArray:
    """Series [..., n] less their lines of best fit.

    >>> levelled(np.array([1.0, 3.0, 5.0])).tolist()
    [0.0, 0.0, 0.0]
    """
    along = np.linspace(-1.0, 1.0, x.shape[-1])
    level = x - x.mean(axis=-1, keepdims=True)
    return np.asarray(level - (level @ along)[..., None] * along / (along @ along))


def hann(n: int) -> FloatArray:
    """Hann's window [n] of one period, as transforms of segments want it.

    >>> hann(4).round(12).tolist()
    [0.0, 0.5, 1.0, 0.5]
    """
    return np.asarray(0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(n) / n))


def csd(x: FloatArray, y: FloatArray, rate: float, n: int) -> tuple[FloatArray, ComplexArray]:
    """Frequencies [Hz] and the one-sided cross spectral density of two series sampled at `rate` [Hz].

    The mean of conj(X) Y over segments of n samples, half overlapped, less their means, behind Hann's window; one
    segment where the series are shorter. Source: Welch, IEEE Trans. Audio Electroacoust. 15 (1967).
    """
    n = min(n, len(x))
    window = hann(n)

    def lines(z: FloatArray) -> ComplexArray:
        segments = np.lib.stride_tricks.sliding_window_view(z, n)[:: n - n // 2]
        return np.asarray(np.fft.rfft((segments - segments.mean(axis=1, keepdims=True)) * window))

    first = lines(x)
    found = np.mean(first.conj() * (first if y is x else lines(y)), axis=0) / (rate * (window @ window))
    return np.asarray(np.fft.rfftfreq(n, 1.0 / rate)), _one_sided(found, n)


def welch(x: FloatArray, rate: float, n: int) -> tuple[FloatArray, FloatArray]:
    """Frequencies [Hz] and the one-sided power density of a series sampled at `rate` [Hz], as `cross` has it."""
    f, found = csd(x, x, rate, n)
    return f, found.real


def periodogram(x: FloatArray, rate: float) -> tuple[FloatArray, FloatArray]:
    """Frequencies [Hz] and the one-sided power density of a whole series less its mean, without a window.

    >>> f, power = periodogram(np.sin(2 * np.pi * 3.0 * np.arange(100) / 100.0), 100.0)
    >>> float(f[np.argmax(power)]), round(float(power.sum() * f[1]), 12)  # the mean square of a sine is half
    (3.0, 0.5)
    """
    found = np.abs(np.fft.rfft(x - x.mean())) ** 2 / (rate * len(x))
    return np.asarray(np.fft.rfftfreq(len(x), 1.0 / rate)), _one_sided(found, len(x))


def _one_sided(found: Any, n: int) -> Any:
    found[1 : len(found) - (n % 2 == 0)] *= 2.0
    return found
