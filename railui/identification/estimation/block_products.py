"""Inner products of series in blocks of time: residuals correlated in time stay together in a block."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from railui.arrays import FloatArray

if TYPE_CHECKING:
    from railui.identification.estimation.problem import FitSegment

MIN_BLOCK_SAMPLES = 8


def block_length(seconds: float, target: FitSegment) -> int:
    """Compared samples in a block of so many seconds."""
    return max(MIN_BLOCK_SAMPLES, round(seconds / (target.segment.dt * target.filter.decimation)))


def split_into_blocks(series: FloatArray, length: int) -> FloatArray:
    """Split series [row, channel, n] into [row, channel, block, sample], the last block padded with zeros."""
    rows, channels, n = series.shape
    count = -(-n // length)
    padded = np.zeros((rows, channels, count * length))
    padded[:, :, :n] = series
    return padded.reshape(rows, channels, count, length)


def block_gram(series: FloatArray, length: int) -> FloatArray:
    """Inner products [block, channel, row, row] of series [row, channel, n] over blocks of so many samples."""
    cut = split_into_blocks(series, length).transpose(2, 1, 0, 3)
    return np.asarray(cut @ cut.transpose(0, 1, 3, 2))


def scaled_inverse(gram: FloatArray, cutoff: float | None = None) -> FloatArray:
    """Invert a symmetric matrix after scaling its diagonal to 1, without directions below `cutoff` of the largest.

    cutoff: that of rounding by default.
    """
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
    cutoff = len(gram) * float(np.finfo(float).eps) if cutoff is None else cutoff
    unit = gram * np.outer(scale, scale)
    return np.asarray(np.linalg.pinv(unit, rcond=cutoff, hermitian=True) * np.outer(scale, scale))
