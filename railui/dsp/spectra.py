"""Spectral densities by Welch's method, correlation and coherence of series.

The functions have the names and conventions of scipy.signal, whose import takes half a second.
"""

from __future__ import annotations

from typing import Literal, TypeVar

import numpy as np

from railui.arrays import ComplexArray, FloatArray

Trend = Literal["mean", "line"]
Lines = TypeVar("Lines", FloatArray, ComplexArray)
MIN_INPUT_SIZE = 1e-5  # of the inputs at a frequency over the largest singular value: less is no input of its own


def detrend(x: FloatArray) -> FloatArray:
    """Subtract from series [..., n] their straight lines of best fit.

    >>> detrend(np.array([1.0, 3.0, 5.0])).tolist()
    [0.0, 0.0, 0.0]
    """
    ramp = np.linspace(-1.0, 1.0, x.shape[-1])
    mean_free = x - x.mean(axis=-1, keepdims=True)
    return np.asarray(mean_free - (mean_free @ ramp)[..., None] * ramp / (ramp @ ramp))


def hann(n: int) -> FloatArray:
    """Return the periodic Hann window [n].

    >>> hann(4).round(12).tolist()
    [0.0, 0.5, 1.0, 0.5]
    """
    return np.asarray(0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(n) / n))


def tukey(n: int, share: float) -> FloatArray:
    """Return the symmetric Tukey window [n], of which a `share` is tapered by half cosines, half of it at each end.

    >>> tukey(5, 1.0).round(12).tolist(), tukey(3, 0.0).tolist()
    ([0.0, 0.5, 1.0, 0.5, 0.0], [1.0, 1.0, 1.0])
    """
    if n < 2 or share <= 0.0:
        return np.ones(n)
    from_end = np.minimum(np.arange(n), np.arange(n)[::-1]) / (n - 1)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.minimum(2.0 * from_end / share, 1.0)))


def csd(x: FloatArray, y: FloatArray, rate: float, n: int, trend: Trend = "mean") -> tuple[FloatArray, ComplexArray]:
    """Estimate the one-sided cross spectral density of two series by Welch's method.

    The mean of conj(X) Y over segments of n samples that overlap by half, with a Hann window; one segment if the
    series are shorter.

    Parameters
    ----------
    x, y : FloatArray
        Series of one length.
    rate : float
        Sampling rate [Hz]; 1/m for series along a track.
    n : int
        Samples of a segment.
    trend : {"mean", "line"}
        Trend that is subtracted from each segment: its mean or its straight line of best fit.

    Returns
    -------
    tuple of FloatArray, ComplexArray
        Frequencies in the unit of `rate`, and the density per that unit.

    References
    ----------
    Welch, IEEE Trans. Audio Electroacoust. 15 (1967).
    """
    n = min(n, len(x))
    window = hann(n)

    def transforms(z: FloatArray) -> ComplexArray:
        segments = np.lib.stride_tricks.sliding_window_view(z, n)[:: n - n // 2]
        level = segments - segments.mean(axis=1, keepdims=True) if trend == "mean" else detrend(segments)
        return np.asarray(np.fft.rfft(level * window))

    first = transforms(x)
    second = first if y is x else transforms(y)
    density = np.mean(first.conj() * second, axis=0) / (rate * (window @ window))
    return np.asarray(np.fft.rfftfreq(n, 1.0 / rate)), _one_sided(density, n)


def welch(x: FloatArray, rate: float, n: int, trend: Trend = "mean") -> tuple[FloatArray, FloatArray]:
    """Estimate the one-sided power spectral density of a series by Welch's method; parameters as in `csd`."""
    f, density = csd(x, x, rate, n, trend)
    return f, density.real


def coherence(x: FloatArray, y: FloatArray, rate: float, n: int) -> tuple[FloatArray, FloatArray]:
    """Estimate the magnitude-squared coherence of two series; parameters as in `csd`.

    >>> x = np.sin(np.arange(400.0) ** 1.5)
    >>> coherence(x, -2.0 * x, 1.0, 100)[1].round(9).min().item()
    1.0
    """
    f, cross = csd(x, y, rate, n)
    return f, np.abs(cross) ** 2 / welch(x, rate, n)[1] / welch(y, rate, n)[1]


def multiple_coherence(inputs: FloatArray, x: FloatArray, rate: float, n: int) -> tuple[FloatArray, FloatArray]:
    """Estimate the share of the power of series [..., k] that is coherent with several inputs [input, k].

    What inputs explain by chance is subtracted: 1 - (1 - c) K/(K - p) with K segments and p inputs. Segments and
    windows as in `csd`.

    Returns
    -------
    tuple of FloatArray, FloatArray
        Frequencies [line] in the unit of `rate`, and the coherence [..., line], 0 to 1; not a number with fewer
        segments than inputs.

    References
    ----------
    Bendat, Piersol, Random Data, 4th ed., 7.3 and 9.3.

    >>> x = np.sin(np.arange(400.0) ** 1.5), np.cos(np.arange(400.0) ** 1.3)
    >>> multiple_coherence(np.array(x), x[0] - 2.0 * x[1], 1.0, 40)[1][1:-1].round(6).min().item()
    1.0
    """
    n = min(n, x.shape[-1])
    window = hann(n)

    def transforms(z: FloatArray) -> ComplexArray:
        segments = np.lib.stride_tricks.sliding_window_view(z, n, axis=-1)[..., :: n - n // 2, :]
        return np.asarray(np.fft.rfft((segments - segments.mean(axis=-1, keepdims=True)) * window))

    series, lines = transforms(x), transforms(inputs)
    f, count, averages = np.asarray(np.fft.rfftfreq(n, 1.0 / rate)), len(inputs), series.shape[-2]
    if averages <= count:
        return f, np.full((*x.shape[:-1], len(f)), np.nan)
    by_frequency = lines.transpose(2, 1, 0)
    scale = np.sqrt(np.sum(np.abs(by_frequency) ** 2, axis=1, keepdims=True)) + 1e-300
    basis, size, _ = np.linalg.svd(by_frequency / scale, full_matrices=False)
    projected = np.abs(np.einsum("fkp,...kf->...fp", basis.conj(), series)) ** 2
    explained = np.sum(projected * (size > MIN_INPUT_SIZE * size[:, :1]), axis=-1)
    share = explained / (np.sum(np.abs(series) ** 2, axis=-2) + 1e-300)
    return f, np.clip(1.0 - (1.0 - share) * averages / (averages - count), 0.0, 1.0)


def periodogram(x: FloatArray, rate: float) -> tuple[FloatArray, FloatArray]:
    """Return frequencies [Hz] and the one-sided power density of a whole series less its mean, without a window.

    >>> f, power = periodogram(np.sin(2 * np.pi * 3.0 * np.arange(100) / 100.0), 100.0)
    >>> float(f[np.argmax(power)]), round(float(power.sum() * f[1]), 12)  # the mean square of a sine is half
    (3.0, 0.5)
    """
    density = np.abs(np.fft.rfft(x - x.mean())) ** 2 / (rate * len(x))
    return np.asarray(np.fft.rfftfreq(len(x), 1.0 / rate)), _one_sided(density, len(x))


def hann_periodogram(x: FloatArray, rate: float) -> tuple[FloatArray, FloatArray]:
    """Return frequencies [Hz] and the one-sided power density of a series less its mean, times a Hann window.

    The density is that of the product: 3/8, the mean square of the window, of that of a stationary series.

    >>> f, power = hann_periodogram(np.sin(2 * np.pi * 3.0 * np.arange(100) / 100.0), 100.0)
    >>> float(f[np.argmax(power)]), round(float(power.sum() * f[1]), 12)
    (3.0, 0.1875)
    """
    return periodogram((x - x.mean()) * hann(len(x)), rate)


def correlate(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the sums of x[i + lag] y[i] for all lags from 1 - len(y) to len(x) - 1, by the Fourier transform.

    >>> correlate(np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0])).round(12).tolist()
    [1.0, 2.0, 3.0, 0.0]
    """
    size = 1 << (len(x) + len(y) - 1).bit_length()
    sums = np.fft.irfft(np.fft.rfft(x, size) * np.fft.rfft(y, size).conj(), size)
    return np.concatenate([sums[size - len(y) + 1 :], sums[: len(x)]])


def _one_sided(density: Lines, n: int) -> Lines:
    """Double all lines but those at frequency 0 and at half the sampling rate."""
    density[1 : len(density) - (n % 2 == 0)] *= 2.0
    return density
