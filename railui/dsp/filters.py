"""Butterworth filters as second-order sections, run forward or with zero phase.

The functions have the names and conventions of scipy.signal, whose import would take half a second of every ride.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from railui.arrays import ComplexArray, FloatArray
from railui.core import sosfilt


def butterworth(order: int, edges: Sequence[float], rate: float) -> FloatArray:
    """Design a Butterworth low-pass or band-pass filter by the bilinear transform with pre-warped edges.

    Parameters
    ----------
    order : int
        Order of the low-pass prototype; a band-pass has twice that order.
    edges : sequence of float
        One edge [Hz] of a low-pass or two edges [Hz] of a band-pass, increasing between 0 and rate/2.
    rate : float
        Sampling rate [Hz].

    Returns
    -------
    FloatArray
        Second-order sections [section, 6] (b0 b1 b2 1 a1 a2).

    Raises
    ------
    ValueError
        For an order below 1, and for edges that do not increase between 0 and rate/2.

    References
    ----------
    Oppenheim, Schafer, Discrete-Time Signal Processing, 7.2.

    Examples
    --------
    >>> butterworth(2, [25.0], 100.0).round(4).tolist()  # (1 + 1/z)^2/(2 + sqrt 2 + (2 - sqrt 2)/z^2)
    [[0.2929, 0.5858, 0.2929, 1.0, -0.0, 0.1716]]
    """
    return _designed(order, tuple(map(float, edges)), float(rate)).copy()


@lru_cache(maxsize=64)
def _designed(order: int, edges: tuple[float, ...], rate: float) -> FloatArray:
    """Design a filter once: the same few serve all channels and runs."""
    if order < 1 or not np.all(np.diff([0.0, *edges, rate / 2]) > 0):
        bounds = f"an order of at least 1 and edges that increase between 0 and {rate / 2:g} Hz"
        raise ValueError(f"a filter needs {bounds}: {order}, {list(edges)}")
    w = np.tan(np.pi * np.asarray(edges) / rate)  # warped edges over 2 rate, the unit of all poles below
    poles = _prototype_poles(order)
    if len(w) == 1:
        poles, numerator, centre = w[0] * poles, [1.0, 2.0, 1.0], 0.0
    else:
        half, centre = 0.5 * (w[1] - w[0]) * poles, float(np.sqrt(w[0] * w[1]))
        root = np.sqrt(half**2 - centre**2)
        poles, numerator = np.concatenate([half + root, half - root]), [1.0, 0.0, -1.0]
    sections = _sections((1.0 + poles) / (1.0 - poles), numerator)
    powers = ((1.0 + 1j * centre) / (1.0 - 1j * centre)) ** -np.arange(3.0)
    sections[:, :3] *= np.abs(sections[:, 3:] @ powers / (sections[:, :3] @ powers))[:, None]  # gain 1 at the centre
    return sections


def _prototype_poles(order: int) -> ComplexArray:
    """Poles of the analog low-pass of unit cut-off frequency."""
    poles = np.exp(0.5j * np.pi * (1.0 + (2.0 * np.arange(order) + 1.0) / order))
    if order % 2:
        poles[order // 2] = -1.0  # exactly real, so that it is not taken for one of a conjugate pair
    return np.asarray(poles)


def _sections(poles: ComplexArray, numerator: Sequence[float]) -> FloatArray:
    """Sections of unit gain from poles in z; two real poles share a section, a single one has a zero at z = -1."""
    sections = [[*numerator, 1.0, -2.0 * p.real, abs(p) ** 2] for p in poles[poles.imag > 0]]
    real = np.sort(poles[poles.imag == 0].real)
    for p, q in zip(real[::2], real[1::2], strict=False):
        sections.append([*numerator, 1.0, -(p + q), p * q])
    if real.size % 2:
        sections.append([1.0, 1.0, 0.0, 1.0, -real[-1], 0.0])
    return np.array(sections)


def sosfilt_zi(sections: FloatArray) -> FloatArray:
    """Return the filter memory [section, 2] of the steady state for a constant input of 1.

    >>> sosfilt_zi(np.array([[1.0, 0.0, 0.0, 1.0, -0.5, 0.0]])).tolist()
    [[1.0, 0.0]]
    """
    b, a = sections[:, :3], sections[:, 3:]
    gain = b.sum(axis=1) / a.sum(axis=1)
    level = np.cumprod([1.0, *gain[:-1]])  # input of each section
    return np.asarray(level[:, None] * np.column_stack([gain - b[:, 0], b[:, 2] - a[:, 2] * gain]))


def frequency_response(sections: FloatArray, w: FloatArray) -> NDArray[np.complex128]:
    """Return the complex response of sections at angular frequencies w [n] in rad per sample.

    >>> abs(frequency_response(butterworth(2, [25.0], 100.0), np.array([0.0, np.pi / 2]))).round(4).tolist()
    [1.0, 0.7071]
    """
    powers = np.exp(-1j * np.outer(np.arange(3.0), w))
    return np.asarray(np.prod((sections[:, :3] @ powers) / (sections[:, 3:] @ powers), axis=0))


def padlen(sections: FloatArray) -> int:
    """Return the number of samples by which `sosfiltfilt` extends both ends: three times the number of taps."""
    if not len(sections):
        return 0
    first_order = min(int(np.sum(sections[:, 2] == 0)), int(np.sum(sections[:, 5] == 0)))
    return 3 * (2 * len(sections) + 1 - first_order)


def sosfiltfilt(sections: FloatArray, x: FloatArray) -> FloatArray:
    """Filter series [..., n] forward and backward; both ends are extended by their point reflection.

    Series shorter than the extension are extended by all of their samples.
    """
    n, extension = x.shape[-1], min(padlen(sections), x.shape[-1] - 1)
    start = 2.0 * x[..., :1] - x[..., extension:0:-1]
    end = 2.0 * x[..., -1:] - x[..., -2 : -2 - extension : -1]
    y = np.concatenate([start, x, end], axis=-1)
    steady = sosfilt_zi(sections)
    for _ in range(2):
        y = sosfilt(sections, y, steady * y[..., :1, None])[..., ::-1]
    return y[..., extension : extension + n]
