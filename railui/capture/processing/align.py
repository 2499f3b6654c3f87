"""Runs over the same line brought to one distance: the shift at which their tracks agree best."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import signal

from railui.arrays import FloatArray

SPACING = 0.25  # m
SLOW, QUICK = 70.0, 3.0  # m: the wavelengths that are compared
SAME_LINE = 0.8  # correlation from which two runs were on the same line
SHORTEST = 300.0  # m of overlap, and half of the shorter run


class Shift(NamedTuple):
    """By how much [m] the second run's distance must be raised, and the correlation there."""

    metres: float
    correlation: float


def align(s_a: FloatArray, yw_a: FloatArray, s_b: FloatArray, yw_b: FloatArray) -> Shift:
    """The shift of b against a along the line, from lateral deviations [n] at rising places [m].

    Only wavelengths of 3 to 70 m count, and only shifts at which 300 m and half of the shorter run overlap.

    >>> s = np.arange(0.0, 900.0, 0.5)
    >>> y = lambda s: np.sin(2 * np.pi * s / 31) + np.sin(2 * np.pi * s / 7.3 + 1) + np.sin(s**2 / 3000)
    >>> round(align(s, y(s), s, y(s + 40.3)).metres, 1)
    40.3
    """
    a, b = _laid(s_a, yw_a), _laid(s_b, yw_b)
    product = signal.correlate(a, b, mode="full")
    ones = np.ones(a.size), np.ones(b.size)
    power = signal.correlate(a**2, ones[1], mode="full") * signal.correlate(ones[0], b**2, mode="full")
    overlap = signal.correlate(*ones, mode="full")
    shorter = SPACING * min(a.size, b.size)
    enough = overlap * SPACING >= min(max(SHORTEST, 0.5 * shorter), 0.9 * shorter)
    values = np.where(enough, product / np.sqrt(np.maximum(power, 1e-300)), -1.0)
    k = int(np.clip(np.argmax(values), 1, values.size - 2))
    bend = values[k - 1] - 2 * values[k] + values[k + 1]
    between = 0.5 * (values[k - 1] - values[k + 1]) / bend if bend else 0.0
    metres = (k - (b.size - 1) + between) * SPACING + s_a[0] - s_b[0]
    return Shift(float(metres), float(values[k]))


def _laid(s: FloatArray, yw: FloatArray) -> FloatArray:
    grid = np.arange(s[0], s[-1], SPACING)
    band = signal.butter(3, [1 / SLOW, 1 / QUICK], "bandpass", fs=1 / SPACING, output="sos")
    return np.asarray(signal.sosfiltfilt(band, np.interp(grid, s, yw)))
