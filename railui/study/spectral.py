"""Power of series over frequency by Welch's method, as scipy.signal has it, which takes half a second to read."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def levelled(x: Floats) -> Floats:
    """Series [..., n] less their lines of best fit.

    >>> levelled(np.array([1.0, 3.0, 5.0])).tolist()
    [0.0, 0.0, 0.0]
    """
    along = np.linspace(-1.0, 1.0, x.shape[-1])
    level = x - x.mean(axis=-1, keepdims=True)
    return np.asarray(level - (level @ along)[..., None] * along / (along @ along))


def density(x: Floats, rate: float, n: int) -> tuple[Floats, Floats]:
    """Frequencies [Hz] and the one-sided power density of a series sampled at `rate` [Hz].

    The mean over segments of n samples, half overlapped, less their means, behind Hann's window; one segment where
    the series is shorter. Source: Welch, IEEE Trans. Audio Electroacoust. 15 (1967).
    """
    n = min(n, len(x))
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(n) / n)
    segments = np.lib.stride_tricks.sliding_window_view(x, n)[:: n - n // 2]
    lines = np.fft.rfft((segments - segments.mean(axis=1, keepdims=True)) * window)
    found = np.asarray(np.mean(np.abs(lines) ** 2, axis=0) / (rate * (window @ window)))
    found[1 : len(found) - (n % 2 == 0)] *= 2.0
    return np.asarray(np.fft.rfftfreq(n, 1.0 / rate)), found
