"""What is left of output differences once the adjustable parameters have taken their part, by inner products alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from railui.arrays import FloatArray
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.evidence import ScoreResult

VANISHED = 1e-3  # share of a difference left by the projection below which nothing new is in it


@dataclass(frozen=True, eq=False)
class ProjectedScores:
    """Lanes seen against a residual: rho, amount, scores [lane, block], what is left of a difference, and told.

    absorbed [lane, p]: what the adjustable parameters make of one; told: is anything left after that? norms [lane,
    block]: what is left, block by block; own: the share left.
    """

    rho: FloatArray
    amount: FloatArray
    scores: FloatArray
    left: FloatArray
    absorbed: FloatArray
    told: NDArray[np.bool_]
    norms: FloatArray
    own: FloatArray

    def sighting(self, candidate: Candidate, shape: int, lane: int) -> ScoreResult:
        """One lane of what was seen."""
        rho, amount, left, own = (float(x[lane]) for x in (self.rho, self.amount, self.left, self.own))
        each = self.scores[lane], left, self.absorbed[lane], self.norms[lane]
        return ScoreResult(candidate, shape, rho, amount, *each, own)


class Projector:
    """Takes off what the adjustable parameters absorb.

    inner [block, 1 + p, 1 + p]: products of the residual and the p sensitivities in blocks of time; precision [p, p]:
    of the priors, in the same measure.
    """

    def __init__(self, inner: FloatArray, precision: FloatArray) -> None:
        self.blocks = inner
        gram = inner.sum(axis=0)
        self.inner, self.right = gram[1:, 1:] + precision, gram[1:, 0]
        scale = 1.0 / np.sqrt(np.maximum(np.diag(self.inner), 1e-300))
        self.inverse = linalg.pinvh(self.inner * np.outer(scale, scale), rtol=1e-10) * np.outer(scale, scale)
        self.beta = self.inverse @ self.right
        self.rest = float(gram[0, 0] - self.right @ self.beta)

    def seen(self, cross: FloatArray, norms: FloatArray, vanished: float = VANISHED) -> ProjectedScores:
        """Differences by their products with residual, sensitivities [block, lane, 1 + p], themselves [block, lane].

        vanished: share left from which something new is told.
        """
        inner, total = self.blocks, cross.sum(axis=0)
        beta = total[:, 1:] @ self.inverse
        each = norms - 2 * np.einsum("lp,blp->bl", beta, cross[:, :, 1:])
        each = each + np.einsum("blp,lp->bl", np.einsum("lp,bpq->blq", beta, inner[:, 1:, 1:]), beta)
        left = each.sum(axis=0)
        own = left / np.maximum(norms.sum(axis=0), 1e-300)
        told = own > vanished
        left = np.where(told, left, 1.0)
        scores = cross[:, :, 0] - inner[:, 1:, 0] @ beta.T - cross[:, :, 1:] @ self.beta
        scores = (scores + np.einsum("bpq,lp,q->bl", inner[:, 1:, 1:], beta, self.beta)).T
        projection = scores.sum(axis=1)
        rho = projection / np.sqrt(left * max(self.rest, 1e-300))
        return ProjectedScores(rho, projection / left, scores, left, beta, told, np.maximum(each.T, 0.0), own)
