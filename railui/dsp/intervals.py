"""Unbroken intervals of samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def true_intervals(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the unbroken intervals [start, stop) of true samples.

    >>> true_intervals(np.array([True, False, True, True]))
    [(0, 1), (2, 4)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
