"""Overlap of two runs: sequences of samples that occur in both."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.runs.columns import Form, column_names

SEQUENCE = 16  # samples; noise makes a repetition by chance impossible
MIN_DISTINCT = 4  # different values of a sequence
MAX_SHARED_SHARE = 0.05  # of the sequences of the shorter run


def shared_share(a: Mapping[str, FloatArray], b: Mapping[str, FloatArray], form: Form | None = None) -> float:
    """Return the share of the sequences of 16 samples of one run that occur in the other.

    Parameters
    ----------
    a, b
        Columns [n] by name; the largest share of a response counts.
    form
        Form of both runs; that of a bogie or a rig by default.
    """
    forms: tuple[Form, ...] = ("bogie", "rig") if form is None else (form,)
    others = {name for each in forms for name in column_names(each, "clock", "track", "coach")}
    return max((_shared(a[name], b[name]) for name in (a.keys() & b.keys()) - others), default=0.0)


def _shared(x: FloatArray, y: FloatArray) -> float:
    first, second = _sequences(x), _sequences(y)
    if not first.size or not second.size:
        return 0.0
    return float(np.intersect1d(first, second).size / min(first.size, second.size))


def _sequences(x: FloatArray) -> NDArray[np.uint64]:
    """Return a hash of each sequence of samples that is neither constant nor interrupted."""
    if x.size < SEQUENCE:
        return np.empty(0, dtype=np.uint64)
    changes = np.concatenate(([0.0], np.diff(x) != 0)).cumsum()
    usable = changes[SEQUENCE - 1 :] - changes[: changes.size - SEQUENCE + 1] >= MIN_DISTINCT
    missing = np.concatenate(([0], np.cumsum(~np.isfinite(x))))
    usable &= missing[SEQUENCE:] == missing[:-SEQUENCE]
    bits = (x + 0.0).view(np.uint64)  # -0 and 0 are one value
    total = np.zeros(x.size - SEQUENCE + 1, dtype=np.uint64)
    with np.errstate(over="ignore"):
        for k in range(SEQUENCE):
            total = total * np.uint64(0x9E3779B97F4A7C15) + (bits[k : k + total.size] ^ np.uint64(k + 1))
            total ^= total >> np.uint64(29)
    return np.unique(total[usable])
