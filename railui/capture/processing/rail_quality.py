"""How good a reconstructed track is: what both wheelsets say of the same rails, band by band."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline

from railui.arrays import FloatArray
from railui.dsp.integrate import highpass_gain
from railui.track import BANDS

SPACING = 0.25  # m
LONG = 200.0  # m: of the pieces between which coherence is taken
AGREE = 0.9  # coherence from which both say the same
FULL = 0.95  # gain of the filter down to which amplitudes are told
REACH = 1.0  # m by which the delay may differ from 2a


@dataclass(frozen=True, eq=False)
class RailQuality:
    """Two versions of one track compared.

    bands: (from, to [m], sd of their mean, rms of their difference [m]); the error of their mean is about half the
    difference. wavelength, coherence [n]; lag [m] the delay that the correlation shows less 2a; `valid` wavelengths
    [m] that can be trusted, None where none.
    """

    bands: tuple[tuple[float, float, float, float], ...]
    wavelength: FloatArray
    coherence: FloatArray
    correlation: float
    lag: float
    valid: tuple[float, float] | None

    @property
    def noise(self) -> float | None:
        """Standard deviation [m] of their mean at wavelengths of the shortest band, where a drift does not count."""
        return self.bands[0][3] / 2 if self.bands else None


def band_rms(x: FloatArray, spacing: float, low: float, high: float) -> float:
    """Root mean square of what x [n] has at wavelengths from low to high [m]; ends tapered.

    >>> s = np.arange(8000) * 0.25
    >>> round(band_rms(np.sin(2 * np.pi * s / 20), 0.25, 3, 25), 2)
    0.71
    >>> round(band_rms(np.sin(2 * np.pi * s / 50), 0.25, 3, 25), 2)
    0.0
    """
    window = signal.windows.tukey(x.size, min(1.0, 100.0 / (x.size * spacing)))
    lines = np.fft.rfft((x - x.mean()) * window)
    n = np.fft.rfftfreq(x.size, spacing)
    inside = (n >= 1 / high) & (n <= 1 / low)
    return float(np.sqrt(2 * np.sum(np.abs(lines[inside]) ** 2) / x.size / np.sum(window**2)))


def compare(
    first: FloatArray, second: FloatArray, s: FloatArray, shortest: float, natural: float, speed: float
) -> RailQuality:
    """Compares two versions [n] along s [m]; `natural` [Hz] and `speed` [m/s] bound what the filter lets through."""
    grid = np.arange(s[0], s[-1], SPACING)
    a, b = (np.asarray(CubicSpline(s, x)(grid)) for x in (first, second))
    bands = tuple(
        (low, high, band_rms(0.5 * (a + b), SPACING, low, high), band_rms(a - b, SPACING, low, high))
        for low, high in BANDS
        if grid.size * SPACING > 2 * high
    )
    size = min(grid.size, round(LONG / SPACING))
    n, coherence = signal.coherence(a, b, 1 / SPACING, nperseg=size, noverlap=size // 2)
    keep = (n > 0) & (n <= 1 / shortest)
    wavelength, coherence = 1 / n[keep], coherence[keep]
    longest = speed / limit_frequency(natural)
    a0, b0 = a - a.mean(), b - b.mean()
    correlation = float(a0 @ b0 / np.sqrt((a0 @ a0) * (b0 @ b0)))
    valid = _agreeing(wavelength, coherence, shortest, longest)
    return RailQuality(bands, wavelength, coherence, correlation, _lag(a0, b0), valid)


def limit_frequency(natural: float, damping: float = np.sqrt(0.5)) -> float:
    """The frequency [Hz] from which the zero-phase high pass lets `FULL` through."""
    tried = natural * np.linspace(1.0, 20.0, 4000)
    return float(tried[np.argmax(highpass_gain(tried, natural, damping) >= FULL)])


def _lag(a: FloatArray, b: FloatArray) -> float:
    """By how much b is late [m]: the top of the correlation, between samples by a parabola."""
    reach = round(REACH / SPACING)
    middle = slice(reach, a.size - reach)
    shifts = range(-reach, reach + 1)
    values = np.array([float(a[middle] @ b[reach + k : a.size - reach + k]) for k in shifts])
    k = int(np.clip(np.argmax(values), 1, len(values) - 2))
    bend = values[k - 1] - 2 * values[k] + values[k + 1]
    return float((k - reach + (0.5 * (values[k - 1] - values[k + 1]) / bend if bend else 0.0)) * SPACING)


def _agreeing(
    wavelength: FloatArray, coherence: FloatArray, shortest: float, longest: float
) -> tuple[float, float] | None:
    """The widest range of wavelengths in which both agree, inside what the filters let through."""
    inside = (wavelength <= longest) & (wavelength >= shortest)
    good = np.concatenate(([False], inside & (coherence >= AGREE), [False]))
    edges = np.flatnonzero(np.diff(good.astype(int)))
    if not edges.size:
        return None
    spans = [(wavelength[b - 1], wavelength[a]) for a, b in edges.reshape(-1, 2)]
    low, high = max(spans, key=lambda span: span[1] / span[0])
    return float(low), float(high)
