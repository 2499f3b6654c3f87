"""Band-limited interpolation of evenly sampled series (windowed sinc)."""

from __future__ import annotations

import numpy as np

from railui.arrays import FloatArray

HALF_WIDTH = 32  # samples at each side of an instant
KAISER_BETA = 9.0  # sidelobes at -90 dB
BLOCK = 1 << 15  # instants at a time: 16 MB of weights


def interpolate_band_limited(start: float, dt: float, x: FloatArray, at: FloatArray) -> FloatArray:
    """Interpolate an evenly sampled series by a sinc under a Kaiser window.

    Exact to 1e-4 below 0.8 of half the sampling rate; the ends are extended by point reflection.

    Parameters
    ----------
    start, dt
        Instant of the first sample, interval [s].
    x
        Values [n].
    at
        Instants between the first and the last sample [s].

    References
    ----------
    Kaiser, Proc. IEEE Int. Symp. Circuits and Systems (1974), 20.

    Examples
    --------
    >>> t = np.arange(200) * 0.02
    >>> at = np.linspace(1.0, 3.0, 77)
    >>> error = interpolate_band_limited(0.0, 0.02, np.sin(2 * np.pi * 15 * t), at) - np.sin(2 * np.pi * 15 * at)
    >>> bool(np.max(np.abs(error)) < 1e-4)
    True
    """
    padded = (
        np.pad(x, HALF_WIDTH, mode="reflect", reflect_type="odd") if x.size > 1 else np.repeat(x, 2 * HALF_WIDTH + 1)
    )
    place = (np.asarray(at) - start) / dt
    taps = np.arange(1 - HALF_WIDTH, HALF_WIDTH + 1)
    result = np.empty(place.shape)
    for begin in range(0, place.size, BLOCK):
        part = place[begin : begin + BLOCK]
        index = np.clip(np.floor(part).astype(int), 0, x.size - 1)
        distance = (part - index)[:, None] - taps
        window = np.i0(KAISER_BETA * np.sqrt(np.maximum(1 - (distance / HALF_WIDTH) ** 2, 0))) / np.i0(KAISER_BETA)
        weights = np.sinc(distance) * window
        weights /= weights.sum(axis=1, keepdims=True)  # a constant remains one
        result[begin : begin + BLOCK] = np.sum(padded[index[:, None] + taps + HALF_WIDTH] * weights, axis=1)
    return result
