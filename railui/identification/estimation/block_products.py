"""Series in blocks of time and their inner products: blocks keep together what is correlated in time."""

from __future__ import annotations

import numpy as np

from railui.arrays import FloatArray
from railui.identification.estimation.problem import FitSegment


def block_length(seconds: float, target: FitSegment) -> int:
    """Compared samples in a block of so many seconds."""
    return max(8, round(seconds / (target.segment.dt * target.filter.every)))


def split_into_blocks(series: FloatArray, length: int) -> FloatArray:
    """Series [row, channel, n] as [row, channel, block, sample], the last block filled up with zeros."""
    rows, channels, n = series.shape
    count = -(-n // length)
    padded = np.zeros((rows, channels, count * length))
    padded[:, :, :n] = series
    return padded.reshape(rows, channels, count, length)


def block_gram(series: FloatArray, length: int) -> FloatArray:
    """Inner products [block, channel, row, row] of series [row, channel, n] over blocks of so many samples."""
    cut = split_into_blocks(series, length).transpose(2, 1, 0, 3)
    return np.asarray(cut @ cut.transpose(0, 1, 3, 2))


def scaled_inverse(gram: FloatArray, least: float) -> FloatArray:
    """The inverse of a symmetric matrix after scaling, without directions smaller than `least` of the largest."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
    unit = gram * np.outer(scale, scale)
    return np.asarray(np.linalg.pinv(unit, rcond=least, hermitian=True) * np.outer(scale, scale))
