"""Second-order sections along series, as scipy.signal has them: half a second that a single ride need not spend."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import sosfilt


def butterworth(order: int, edges: Sequence[float], rate: float) -> FloatArray:
    """Sections [n, 6] (b0 b1 b2 1 a1 a2) of a low pass, or with two edges [Hz] of a band pass of twice the order.

    By the bilinear transform, warped so that the edges stay where they are; `rate` [Hz] of the samples, even `order`.
    Raises ValueError for an odd order, and for edges that do not increase between 0 and rate/2. Source: Oppenheim,
    Schafer, Discrete-Time Signal Processing, 7.2.

    >>> butterworth(2, [25.0], 100.0).round(4).tolist()  # (1 + 1/z)^2/(2 + sqrt 2 + (2 - sqrt 2)/z^2)
    [[0.2929, 0.5858, 0.2929, 1.0, -0.0, 0.1716]]
    """
    if order % 2 or not np.all(np.diff([0.0, *edges, rate / 2]) > 0):
        raise ValueError(f"a filter needs an even order and edges between 0 and {rate / 2:g} Hz: {order}, {edges}")
    w = np.tan(np.pi * np.asarray(edges) / rate)  # of 2 rate, as all poles
    poles = np.exp(0.5j * np.pi * (1.0 + (2.0 * np.arange(order) + 1.0) / order))
    if len(w) == 1:
        poles, top, centre = w[0] * poles, [1.0, 2.0, 1.0], 0.0
    else:
        half, centre = 0.5 * (w[1] - w[0]) * poles, float(np.sqrt(w[0] * w[1]))
        apart = np.sqrt(half**2 - centre**2)
        poles, top = np.concatenate([half + apart, half - apart]), [1.0, 0.0, -1.0]
    z = ((1.0 + poles) / (1.0 - poles))[poles.imag > 0]
    sections = np.array([[*top, 1.0, -2.0 * p.real, abs(p) ** 2] for p in z])
    powers = ((1.0 + 1j * centre) / (1.0 - 1j * centre)) ** -np.arange(3.0)
    sections[:, :3] *= np.abs(sections[:, 3:] @ powers / (sections[:, :3] @ powers))[:, None]  # 1 at the centre
    return sections


def sosfilt_zi(sections: FloatArray) -> FloatArray:
    """What sections remember [n, 2] in the steady state of an input of 1.

    >>> steady(np.array([[1.0, 0.0, 0.0, 1.0, -0.5, 0.0]])).tolist()
    [[1.0, 0.0]]
    """
    b, a = sections[:, :3], sections[:, 3:]
    gain = b.sum(axis=1) / a.sum(axis=1)
    before = np.cumprod([1.0, *gain[:-1]])
    return np.asarray(before[:, None] * np.column_stack([gain - b[:, 0], b[:, 2] - a[:, 2] * gain]))


def frequency_response(sections: FloatArray, w: FloatArray) -> NDArray[np.complex128]:
    """What sections pass at angular frequencies w [n] per sample.

    >>> abs(response(butterworth(2, [25.0], 100.0), np.array([0.0, np.pi / 2]))).round(4).tolist()
    [1.0, 0.7071]
    """
    powers = np.exp(-1j * np.outer(np.arange(3.0), w))
    return np.asarray(np.prod((sections[:, :3] @ powers) / (sections[:, 3:] @ powers), axis=0))


def padlen(sections: FloatArray) -> int:
    """Samples by which `zero_phase` mirrors both ends."""
    return 3 * (2 * len(sections) + 1) if len(sections) else 0


def sosfiltfilt(sections: FloatArray, x: FloatArray) -> FloatArray:
    """Series [..., n] forwards and backwards through sections, both ends mirrored in themselves before."""
    n, beyond = x.shape[-1], min(padlen(sections), x.shape[-1] - 1)
    begin = 2.0 * x[..., :1] - x[..., beyond:0:-1]
    end = 2.0 * x[..., -1:] - x[..., -2 : -2 - beyond : -1]
    y = np.concatenate([begin, x, end], axis=-1)
    for _ in range(2):
        y = sosfilt(sections, y, sosfilt_zi(sections) * y[..., :1, None])[..., ::-1]
    return y[..., beyond : beyond + n]
