"""Score of a change of the model: its amount, its scores per block of time, and their standard deviation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.identification.estimation.covariance import effective_freedom
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.student import as_normal, from_normal, noncentrality

MIN_SCORE_FREEDOM = 1.0
LONELY = 1e-6  # share of all other blocks below which a single block determines the amount


@dataclass(frozen=True, eq=False, kw_only=True)
class BlockScore:
    """Score of a change of the model in one direction, in blocks of time.

    Attributes
    ----------
    rho
        Partial correlation of its output difference with the residual.
    amount
        Amount that explains the residual best.
    scores
        Scores [block] of the blocks of time.
    norm, block_norms
        Squared length of the output difference that the estimated parameters leave, in all and [block]; without block
        norms all blocks are alike.
    absorbed
        Change [p] of the estimated parameters that absorbs an amount of 1.
    unabsorbed_share
        Share of the squared length that they leave.
    phases
        Phase [rad] of a periodic effect in the middle of each segment that explains most.
    quadrature_scores, segment_of_block
        Scores [block] in quadrature to these phases, and the segment of each block.
    """

    rho: float
    amount: float
    scores: FloatArray
    norm: float
    absorbed: FloatArray = field(default_factory=lambda: np.zeros(0), repr=False)
    block_norms: FloatArray = field(default_factory=lambda: np.zeros(0), repr=False)
    unabsorbed_share: float = 1.0
    phases: Mapping[str, float] = field(default_factory=dict)
    quadrature_scores: FloatArray = field(default_factory=lambda: np.zeros(0), repr=False)
    segment_of_block: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64), repr=False)

    @property
    def is_one_sided(self) -> bool:
        """True if only a positive amount is possible."""
        return False

    @property
    def z(self) -> float:
        """Score over its standard deviation from blocks (HC3), as a standard normal variable."""
        sd = self.standard_deviation
        return float(as_normal(self.scores.sum() / sd, self.degrees_of_freedom)) if sd > 0 else 0.0

    @property
    def admissible_z(self) -> float:
        """z, absolute where both signs of the amount are possible."""
        return self.z if self.is_one_sided else abs(self.z)

    @property
    def leverage(self) -> FloatArray:
        """Weight [block] of each block in the estimate of the amount; an intermittent effect has few large ones."""
        if not self.block_norms.size:
            return np.full(len(self.scores), 1.0 / len(self.scores))
        return np.asarray(self.block_norms / max(self.block_norms.sum(), 1e-300))

    @property
    def residual_scores(self) -> FloatArray:
        """Scores [block] less the part of the effect, its amount estimated without that block.

        s_b - a_b n_b with a_b = sum of the other s / sum of the other n, n_b the squared length in the block: the
        leave-one-out residuals of least squares, the variance of which is consistent under any heteroscedasticity
        (HC3: MacKinnon and White, J. Econometrics 29 (1985) 305). Scores less their mean would count the uneven action
        of an intermittent effect as noise.
        """
        h = self.leverage
        return np.asarray((self.scores - h * self.scores.sum()) / np.maximum(1.0 - h, LONELY))

    @property
    def degrees_of_freedom(self) -> float:
        """Degrees of freedom of the standard deviation: effective number of blocks less one."""
        return float(effective_freedom(self.leverage, MIN_SCORE_FREEDOM))

    @property
    def standard_deviation(self) -> float:
        """Standard deviation of the score from blocks."""
        return float(np.linalg.norm(self.residual_scores))

    def detectable_amount(self, critical: float, power_quantile: float) -> float:
        """Return the amount whose score exceeds a critical one [standard normal] with the power of a quantile."""
        freedom = self.degrees_of_freedom
        return (
            noncentrality(from_normal(critical, freedom), freedom, power_quantile) * self.standard_deviation / self.norm
        )


@dataclass(frozen=True, eq=False)
class ScoreResult(BlockScore):
    """Score of one shape of a candidate.

    Attributes
    ----------
    is_extrapolated
        True for a result from a part of the runs: chance correlates more with fewer samples.
    """

    candidate: Candidate
    shape: int
    is_extrapolated: bool = False

    @property
    def is_one_sided(self) -> bool:
        """True if the strength of the candidate has only one sign."""
        return self.candidate.is_one_sided

    @property
    def admissible_rho(self) -> float:
        """Absolute rho; 0 for a one-sided candidate with a negative one."""
        return max(self.rho, 0.0) if self.is_one_sided else abs(self.rho)

    def extrapolate(self, ratio: float, blocks: int) -> ScoreResult:
        """Extrapolate the result to a run longer by a ratio, with a number of blocks."""
        per_block = {
            "scores": self.scores,
            "block_norms": self.block_norms,
            "quadrature_scores": self.quadrature_scores,
            "segment_of_block": self.segment_of_block,
        }
        resized = {name: np.resize(x, blocks) for name, x in per_block.items() if x.size}
        return replace(self, norm=ratio * self.norm, is_extrapolated=True, **resized)  # type: ignore[arg-type]
