"""Projection of output differences onto the complement of the estimated parameters, by inner products alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from railui.arrays import FloatArray
from railui.identification.estimation.free_parameters import FreeParameters
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.score_result import BlockScore, ScoreResult

HELD_PRECISION = 1e6  # of a parameter held on its bound, in its own information


@dataclass(frozen=True, eq=False)
class ProjectedScores:
    """Scores of lanes against a residual, after projection.

    rho, amount [lane]; scores [lane, block]; norm [lane] and block_norms [lane, block]: squared length of the projected
    difference; absorbed [lane, p]: change of the estimated parameters that absorbs an amount of 1; unabsorbed_share
    [lane]: share of the squared length that they leave; is_distinguishable [lane]: whether it is large enough.
    """

    rho: FloatArray
    amount: FloatArray
    scores: FloatArray
    norm: FloatArray
    absorbed: FloatArray
    is_distinguishable: NDArray[np.bool_]
    block_norms: FloatArray
    unabsorbed_share: FloatArray

    def score_result(self, candidate: Candidate, shape: int, lane: int) -> ScoreResult:
        """Return the score result of one lane."""
        return ScoreResult(candidate, shape, **self._attributes(lane))

    def block_score(self, lane: int) -> BlockScore:
        """Return the score of one lane, which is that of no candidate."""
        return BlockScore(**self._attributes(lane))

    def _attributes(self, lane: int) -> dict[str, Any]:
        return {
            "rho": float(self.rho[lane]),
            "amount": float(self.amount[lane]),
            "scores": self.scores[lane],
            "norm": float(self.norm[lane]),
            "absorbed": self.absorbed[lane],
            "block_norms": self.block_norms[lane],
            "unabsorbed_share": float(self.unabsorbed_share[lane]),
        }


class Projector:
    """Projection that removes the part which the estimated parameters absorb.

    A parameter that the residual presses against its bound absorbs nothing.

    Parameters
    ----------
    inner
        Inner products [block, 1 + p, 1 + p] of the residual and the p sensitivities in blocks of time.
    free
        The p parameters.
    x
        Their estimates [p].
    variance
        Variance of the residual, which gives the priors the scale of the inner products.
    """

    def __init__(self, inner: FloatArray, free: FreeParameters, x: FloatArray, variance: float) -> None:
        self.block_products = inner
        gram = inner.sum(axis=0)
        self.residual_products = gram[1:, 0]
        information = np.diag(gram)[1:]
        outwards = np.where(x - free.low < free.high - x, -1.0, 1.0)
        is_held = free.are_on_bound(x) & (outwards * self.residual_products > 0.0)
        precision = variance / free.prior_sd**2 + np.where(is_held, HELD_PRECISION * information, 0.0)
        self.normal_matrix = gram[1:, 1:] + np.diag(precision)
        scale = 1.0 / np.sqrt(np.maximum(np.diag(self.normal_matrix), 1e-300))
        self.inverse = linalg.pinvh(self.normal_matrix * np.outer(scale, scale), rtol=1e-10) * np.outer(scale, scale)
        self.estimate = self.inverse @ self.residual_products
        self.rss = float(gram[0, 0] - self.residual_products @ self.estimate)

    def project(self, cross: FloatArray, norms: FloatArray, min_remaining_share: float) -> ProjectedScores:
        """Project output differences and score them against the residual.

        Parameters
        ----------
        cross
            Inner products [block, lane, 1 + p] of the differences with the residual and the sensitivities.
        norms
            Squared lengths [block, lane] of the differences.
        min_remaining_share
            Share of the squared length from which a difference is distinguishable from the parameters.
        """
        inner, total = self.block_products, cross.sum(axis=0)
        beta = total[:, 1:] @ self.inverse
        block_norms = norms - 2 * np.einsum("lp,blp->bl", beta, cross[:, :, 1:])
        block_norms = block_norms + np.einsum("blp,lp->bl", np.einsum("lp,bpq->blq", beta, inner[:, 1:, 1:]), beta)
        norm = block_norms.sum(axis=0)
        unabsorbed_share = norm / np.maximum(norms.sum(axis=0), 1e-300)
        is_distinguishable = unabsorbed_share > min_remaining_share
        norm = np.where(is_distinguishable, norm, 1.0)
        scores = cross[:, :, 0] - inner[:, 1:, 0] @ beta.T - cross[:, :, 1:] @ self.estimate
        scores = (scores + np.einsum("bpq,lp,q->bl", inner[:, 1:, 1:], beta, self.estimate)).T
        projection = scores.sum(axis=1)
        rho = projection / np.sqrt(norm * max(self.rss, 1e-300))
        return ProjectedScores(
            rho,
            amount=projection / norm,
            scores=scores,
            norm=norm,
            absorbed=beta,
            is_distinguishable=is_distinguishable,
            block_norms=np.maximum(block_norms.T, 0.0),
            unabsorbed_share=unabsorbed_share,
        )

    def gram(self, cross: FloatArray, inner: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Project inner products of output differences.

        Parameters
        ----------
        cross
            Inner products [lane, 1 + p] of the differences with the residual and the sensitivities.
        inner
            Inner products [lane, lane] of the differences with each other.

        Returns
        -------
        tuple of array
            Inner products [lane, lane] of the projected differences, and their scores [lane].
        """
        total = self.block_products.sum(axis=0)
        beta = cross[:, 1:] @ self.inverse
        shared = cross[:, 1:] @ beta.T
        projected = inner - shared - shared.T + beta @ total[1:, 1:] @ beta.T
        scores = cross[:, 0] - beta @ total[1:, 0] - (cross[:, 1:] - beta @ total[1:, 1:]) @ self.estimate
        return np.asarray(projected), np.asarray(scores)
