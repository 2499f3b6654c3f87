"""Alignment of runs over the same line: the shift at which their tracks correlate best."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.dsp.filters import butterworth, sosfiltfilt
from railui.dsp.spectra import correlate

GRID_SPACING = 0.25  # m
MAX_WAVELENGTH = 70.0  # m
MIN_WAVELENGTH = 3.0  # m
BAND_PASS_ORDER = 3
MIN_CORRELATION = 0.8  # of two runs on the same line
MIN_OVERLAP = 300.0  # m, and half of the shorter run
MAX_OVERLAP_SHARE = 0.9  # of the shorter run that may be required


class Shift(NamedTuple):
    """Distance [m] to be added to the second run's, and the correlation at this shift."""

    metres: float
    correlation: float


def find_shift(s_a: FloatArray, yw_a: FloatArray, s_b: FloatArray, yw_b: FloatArray) -> Shift:
    """Find the shift of run b against run a along the line by cross-correlation.

    Only wavelengths of 3 to 70 m count, and only shifts at which 300 m and half of the shorter run overlap.

    Parameters
    ----------
    s_a, s_b
        Increasing distances [m], [n].
    yw_a, yw_b
        Lateral deviations of the track [n].

    Examples
    --------
    >>> s = np.arange(0.0, 900.0, 0.5)
    >>> y = lambda s: np.sin(2 * np.pi * s / 31) + np.sin(2 * np.pi * s / 7.3 + 1) + np.sin(s**2 / 3000)
    >>> round(find_shift(s, y(s), s, y(s + 40.3)).metres, 1)
    40.3
    """
    a = _resample(s_a, yw_a)
    b = _resample(s_b, yw_b)
    ones_a = np.ones(a.size)
    ones_b = np.ones(b.size)
    power = correlate(a**2, ones_b) * correlate(ones_a, b**2)
    overlap = correlate(ones_a, ones_b) * GRID_SPACING
    shorter = GRID_SPACING * min(a.size, b.size)
    is_allowed = overlap >= min(max(MIN_OVERLAP, 0.5 * shorter), MAX_OVERLAP_SHARE * shorter)
    correlation = np.where(is_allowed, correlate(a, b) / np.sqrt(np.maximum(power, 1e-300)), -1.0)
    k, offset = parabolic_peak(correlation)
    metres = (k - (b.size - 1) + offset) * GRID_SPACING + s_a[0] - s_b[0]
    return Shift(float(metres), float(correlation[k]))


def parabolic_peak(values: FloatArray) -> tuple[int, float]:
    """Return the index of the largest inner value, and the offset of the parabola's vertex from it.

    >>> k, offset = parabolic_peak(np.array([0.0, 2.0, 4.0, 3.0, 0.0]))
    >>> k, round(offset, 4)
    (2, 0.1667)
    """
    k = int(np.clip(np.argmax(values), 1, values.size - 2))
    curvature = values[k - 1] - 2 * values[k] + values[k + 1]
    return k, float(0.5 * (values[k - 1] - values[k + 1]) / curvature) if curvature else 0.0


def _resample(s: FloatArray, yw: FloatArray) -> FloatArray:
    """Interpolate to an even grid and band-pass filter."""
    grid = np.arange(s[0], s[-1], GRID_SPACING)
    band = butterworth(BAND_PASS_ORDER, [1 / MAX_WAVELENGTH, 1 / MIN_WAVELENGTH], 1 / GRID_SPACING)
    return sosfiltfilt(band, np.interp(grid, s, yw))
