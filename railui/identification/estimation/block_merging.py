"""Merging of blocks of time that are not independent of their neighbours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray

LEAST_MERGED = 8  # blocks that are left where neighbours are merged
NEIGHBOUR_STANDARD_ERRORS = 2.0  # by which the correlation of neighbours exceeds zero where they are merged
TIMES_PER_BLOCK = 2.0  # over which the parts are correlated, in a merged block


def independent_edges(parts: FloatArray) -> NDArray[np.int64]:
    """Return the first block of each group of blocks that counts as independent of the next.

    An unmeasured force moves a lightly damped rig for its time of decay, whatever the share of the record in a block.
    The correlation r of neighbours is the mean over the columns; in noise its standard error is at most 1/sqrt(B). As
    that of a first-order process it makes (1 + r)/(1 - r) blocks one independent one. Of eight blocks or fewer no
    correlation is estimated: with r = 0.5 a test at 1 % rejects in some 5 % of sound records of 4 to 12 blocks.

    Parameters
    ----------
    parts : array [block, column]
        Parts of the blocks in sums that are zero.

    References
    ----------
    Bayley and Hammersley, J. Royal Statist. Soc. Suppl. 8 (1946) 184: effective number of independent observations.

    Examples
    --------
    >>> independent_edges(np.array([[1.0], [-1.0]] * 8)).size
    16
    >>> independent_edges(np.repeat([[1.0], [-1.0]] * 4, 4, axis=0)).tolist()
    [0, 4, 8, 12, 16, 20, 24, 28]
    """
    count = left = len(parts)
    if count > LEAST_MERGED:
        power = np.maximum(np.sum(parts**2, axis=0), 1e-300)
        r = float(np.mean(np.sum(parts[1:] * parts[:-1], axis=0) / power))
        if r > NEIGHBOUR_STANDARD_ERRORS / np.sqrt(count):
            left = max(int(count * (1.0 - r) / (1.0 + r) / TIMES_PER_BLOCK), LEAST_MERGED)
    return np.linspace(0, count, left, endpoint=False).astype(np.int64)
