"""Confidence intervals of Sobol's indices by the bootstrap, and the warning where the samples do not determine them."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray

CONFIDENCE: Final = 0.95
RESAMPLES: Final = 999  # of the bootstrap, the number of scipy.stats
# wider intervals, +/- 0.15 of the variance, leave open which of two variables matters more
MAX_INTERVAL_WIDTH: Final = 0.3
BOOTSTRAP_STREAM: Final = 3  # random stream of the resamples, combined with the seed


def index_intervals(a: FloatArray, b: FloatArray, ab: FloatArray, seed: int) -> FloatArray:
    """Return the intervals [first or total, end, objective, variable] of Sobol's indices.

    The bias-corrected and accelerated bootstrap over the samples, as `bootstrap` of scipy.stats.sobol_indices takes
    it, but with a seed. The samples count as independent; those of a sequence with low discrepancy are better, so that
    the intervals are rather too wide. NaN for an objective that does not vary.

    Parameters
    ----------
    a, b : float [objective, sample]
        Objectives at both independent sets of samples.
    ab : float [variable, objective, sample]
        Objectives at the first set with one variable of the second.
    seed : int

    References
    ----------
    Saltelli et al., Comput. Phys. Comm. 181 (2010), table 2 (b), (f); Efron, J. Am. Stat. Assoc. 82 (1987).
    """
    from scipy import stats

    mean = np.mean([a, b], axis=(0, -1))[:, None]
    a, b, ab = a - mean, b - mean, ab - mean

    def indices(chosen: Any) -> FloatArray:
        one, other, mixed = a[:, chosen], b[:, chosen], ab[..., chosen]
        variance = np.var([one, other], axis=(0, -1))
        first = np.mean(other * (mixed - one), axis=-1) / variance
        total = 0.5 * np.mean((one - mixed) ** 2, axis=-1) / variance
        return np.stack([first.T, total.T])

    rng = np.random.default_rng(np.random.SeedSequence([seed, BOOTSTRAP_STREAM]))
    numbers = [np.arange(a.shape[-1])]
    with np.errstate(invalid="ignore", divide="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", stats.DegenerateDataWarning)
        found: Any = stats.bootstrap(
            numbers, indices, n_resamples=RESAMPLES, confidence_level=CONFIDENCE, method="BCa", rng=rng
        )
    return np.stack([found.confidence_interval.low, found.confidence_interval.high], axis=1)


def width_warnings(sobol: Mapping[str, Any] | None) -> list[str]:
    """Return a warning with the widest interval if it is wider than `MAX_INTERVAL_WIDTH`.

    >>> row = {"path": "contact.conicity", "first_interval": [[0.2, 0.6]], "total_interval": [[0.7, None]]}
    >>> width_warnings({"samples": 256, "variables": [row]})[0].partition(":")[0]
    'a Sobol index of contact.conicity is known to 0.2...0.6 only'
    """
    rows: Sequence[Mapping[str, Any]] = [] if sobol is None else sobol["variables"]
    ends = [
        (high - low, row["path"], low, high)
        for row in rows
        for key in ("first_interval", "total_interval")
        for low, high in row[key]
        if low is not None and high is not None
    ]
    if sobol is None or not ends or max(ends)[0] <= MAX_INTERVAL_WIDTH:
        return []
    _, path, low, high = max(ends)
    samples = f"give more samples than {sobol['samples']}, such as --samples {4 * sobol['samples']}"
    return [f"a Sobol index of {path} is known to {low:.2g}...{high:.2g} only: {samples}, which halve the interval"]
