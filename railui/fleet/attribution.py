"""Attribution of a change to one parameter or effect, from how each of them moves all estimates of a run.

A parameter that changes moves its own estimate. An effect moves its amount, and the estimates of the parameters and the
amounts of other effects that resemble it. Generalised least squares compares the measured change of all quantities with
these directions, in the covariance that sound vehicles of the fleet show.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import linalg, stats

from railui.arrays import FloatArray
from railui.fleet.summary import RunSummary
from railui.identification.estimation.block_products import scaled_inverse

MIN_LENGTH: Final = 1e-9  # of an effect that the parameters leave, over the whole


@dataclass(frozen=True)
class Explanation:
    """Hypothesis that one quantity has changed: its size (difference to the expected value) and its deviance."""

    name: str
    change: float
    sd: float
    deviance: float


@dataclass(frozen=True)
class Attribution:
    """Explanations of a change, the best first, and the deviance of the whole change of so many quantities."""

    explanations: tuple[Explanation, ...]
    total: float
    quantities: int

    @property
    def explained(self) -> float:
        """Share of the deviance, less its expected value without a further change, that the best one reaches."""
        if not self.explanations:
            return 0.0
        best = self.explanations[0].deviance
        return float(np.clip(best / max(self.total - (self.quantities - 1), best, 1e-300), 0.0, 1.0))

    @property
    def fit_probability(self) -> float:
        """Probability of a larger misfit if the best explanation is true: chi-squared, a degree of freedom less."""
        if not self.explanations:
            return 0.0
        return float(stats.chi2.sf(self.total - self.explanations[0].deviance, max(self.quantities - 1, 1)))


def attribute(change: FloatArray, covariance: FloatArray, signatures: Mapping[str, FloatArray]) -> Attribution:
    """Compare explanations of a change.

    Parameters
    ----------
    change : array [q]
    covariance : array [q, q]
        Of the change of a sound vehicle.
    signatures : mapping of str to array [q]
        Change by one unit of each hypothesis.

    Notes
    -----
    With the covariance C and the signature h the size is h'C^-1 d / (h'C^-1 h), and the deviance, the reduction of
    d'C^-1 d, is (h'C^-1 d)^2 / (h'C^-1 h): generalised least squares, A. C. Aitken, Proc. Roy. Soc. Edinburgh 55
    (1936) 42; the deviance is the likelihood ratio of S. S. Wilks, Ann. Math. Stat. 9 (1938) 60.
    """
    inverse = linalg.pinvh(covariance)
    weighted = inverse @ change
    found = []
    for name, h in signatures.items():
        information = float(h @ inverse @ h)
        if information > 0.0:
            size = float(h @ weighted) / information
            found.append(Explanation(name, size, information**-0.5, size**2 * information))
    best_first = sorted(found, key=lambda e: (-e.deviance, e.name))
    return Attribution(tuple(best_first), float(change @ weighted), len(change))


def signatures_of(
    summaries: Sequence[RunSummary], weights: FloatArray, names: Sequence[str], scale: FloatArray
) -> dict[str, FloatArray]:
    """Change of the followed quantities [q] by a unit of each of them.

    Parameters
    ----------
    summaries, weights
        Runs since the change began.
    names, scale
        Followed parameters and effects [q], and the values of a unit.

    Notes
    -----
    With the inner products S'S, S'd and d'd of the runs, and A = S'S + P as in the quick path, an amount 1 of the
    effect k moves the parameters by A^-1 S'd_k and the amount of the effect l by d_l'M d_k / (d_l'M d_l), with
    M = I - S A^-1 S'.
    """
    first = summaries[0]
    p, known = len(first.paths), (*first.paths, *first.directions)
    products = sum(w * s.gram / s.variance for s, w in zip(summaries, weights, strict=True))
    precision = sum(
        w * np.maximum(1.0 - s.determined[:p], 0.0) / s.sd[:p] ** 2 for s, w in zip(summaries, weights, strict=True)
    )
    gram = np.asarray(products)[1:, 1:]
    a = gram[:p, :p] + np.diag(np.asarray(precision))
    moved = scaled_inverse(a) @ gram[:p, p:]  # parameters by each effect
    left = gram[p:, p:] - gram[p:, :p] @ moved
    length = np.diag(left)
    safe = np.where(length > MIN_LENGTH * np.diag(gram)[p:], length, np.inf)
    every = np.zeros((len(known), len(known)))
    every[:p, :p] = np.eye(p)
    every[:p, p:] = moved
    every[p:, p:] = left / safe[:, None]
    at = [known.index(name) for name in names]
    chosen = every[np.ix_(at, at)] / scale[:, None] * scale[None, :]
    return {name: chosen[:, j] for j, name in enumerate(names)}
