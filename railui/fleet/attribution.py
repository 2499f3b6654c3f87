"""Attribution of a change to one parameter or effect, from the inner products of the runs since it began.

The runs since the onset are compared with what was expected of their vehicle before it. A hypothesis lets one quantity
change freely, and all parameters within what they vary usually; its deviance is what that explains of the residual.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.arrays import FloatArray
from railui.fleet.summary import RunSummary

PENALTY: Final = 2.0  # of a free number, on the scale of the deviance (Akaike)


@dataclass(frozen=True)
class Explanation:
    """Hypothesis that one quantity has changed: its size (difference to the expected value) and its deviance."""

    name: str
    change: float
    sd: float
    deviance: float


@dataclass(frozen=True)
class Attribution:
    """Explanations of a change, the best first, and the deviance of all changes together."""

    explanations: tuple[Explanation, ...]
    total: float

    @property
    def explained(self) -> float:
        """Share of the explainable deviance that the best explanation alone reaches, each free number penalised."""
        if not self.explanations:
            return 0.0
        best = self.explanations[0].deviance - PENALTY
        return float(np.clip(best / max(self.total, best, 1e-300), 0.0, 1.0))


def shifted_gram(summary: RunSummary, expected: FloatArray) -> FloatArray:
    """Inner products of a run about other values [p + k] of parameters and effects, per independent variance.

    With r = r_0 - S (x - x_0) - D a, the residual at x, a has the products C'G C with C = [[1, 0], [-(x - x_0, a), I]].
    """
    p = len(summary.x)
    change = expected.copy()
    change[:p] -= summary.x
    map_ = np.eye(len(summary.gram))
    map_[1:, 0] = -change
    return np.asarray(map_.T @ summary.gram @ map_ / summary.variance)


def attribute(
    summaries: Sequence[RunSummary],
    expected: FloatArray,
    spread: FloatArray,
    scale: FloatArray,
    excess: float = 1.0,
) -> Attribution:
    """Compare the explanations of a change.

    Parameters
    ----------
    expected : array [run, p + k]
        Parameters and amounts that were expected of each run.
    spread : array [p + k]
        Standard deviations of what parameters vary usually; infinite: free, zero: fixed.
    scale : array [p + k]
        Sizes of the numbers, for the report.
    excess
        Variance of the errors of runs over that of their products.
    """
    first = summaries[0]
    p, names = len(first.paths), (*first.paths, *first.directions)
    gram = np.sum([shifted_gram(s, e) for s, e in zip(summaries, expected, strict=True)], axis=0) / excess
    usual = np.where(spread[:p] > 0.0, spread[:p], 1e-12 * scale[:p])
    precision = np.concatenate([1.0 / usual**2, np.zeros(len(names) - p)])
    base, _, _ = _deviance(gram, list(range(p)), precision)
    found = []
    for j, name in enumerate(names):
        if gram[1 + j, 1 + j] <= 0.0:
            continue
        free = precision.copy()
        free[j] = 0.0
        deviance, estimate, sd = _deviance(gram, sorted({*range(p), j}), free, j)
        found.append(Explanation(name, estimate, sd, deviance - base))
    everything = [j for j in range(len(names)) if gram[1 + j, 1 + j] > 0.0]
    ridge = np.where(np.arange(len(names)) < p, 0.0, 1e-9 * np.diag(gram)[1:])
    total, _, _ = _deviance(gram, everything, ridge)
    best_first = sorted(found, key=lambda e: (-e.deviance, e.name))
    return Attribution(tuple(best_first), max(total - base - PENALTY * len(everything), 0.0))


def _deviance(
    gram: FloatArray, free: Sequence[int], precision: FloatArray, of: int | None = None
) -> tuple[float, float, float]:
    """Deviance that free numbers explain, and the estimate of one of them with its standard deviation."""
    index = np.array(free)
    a = gram[np.ix_(1 + index, 1 + index)] + np.diag(precision[index])
    right = gram[1 + index, 0]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(a), 1e-300))
    inverse = np.linalg.pinv(a * np.outer(scale, scale), rcond=1e-10, hermitian=True) * np.outer(scale, scale)
    solution = inverse @ right
    if of is None:
        return float(right @ solution), 0.0, 0.0
    at = list(free).index(of)
    return float(right @ solution), float(solution[at]), float(np.sqrt(max(inverse[at, at], 0.0)))
