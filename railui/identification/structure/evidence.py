"""Score results of candidates, and the family-wise test of the best against noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from railui.arrays import FloatArray
from railui.campaign.settings.detection import ScoreTestSettings
from railui.identification.estimation.covariance import effective_freedom
from railui.identification.structure.candidates import Candidate
from railui.parallel import map_threads

MIN_SCORE_FREEDOM = 1.0
BOOTSTRAP_PARTS = 4  # of the draws, over threads
LONELY = 1e-6  # share of all other blocks below which a single block determines the amount
FEW_BLOCKS = 12  # below which random signs have too few patterns
SIX_POINTS = np.sqrt(np.array([0.5, 1.0, 1.5]))  # and their negatives: mean 0, variance 1


@dataclass(frozen=True, eq=False)
class ScoreResult:
    """Score of one shape of a candidate.

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

    candidate: Candidate
    shape: int
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
    def z(self) -> float:
        """Score over its standard deviation from blocks (HC3), as a standard normal variable."""
        sd = self.standard_deviation
        return float(as_normal(self.scores.sum() / sd, self.degrees_of_freedom)) if sd > 0 else 0.0

    @property
    def admissible_rho(self) -> float:
        """Absolute rho; 0 for a one-sided candidate with a negative one."""
        return max(self.rho, 0.0) if self.candidate.is_one_sided else abs(self.rho)

    def extrapolate(self, ratio: float, blocks: int) -> ScoreResult:
        """Extrapolate the result to a run longer by a ratio, with a number of blocks."""
        per_block = {
            "scores": self.scores,
            "block_norms": self.block_norms,
            "quadrature_scores": self.quadrature_scores,
            "segment_of_block": self.segment_of_block,
        }
        resized = {name: np.resize(x, blocks) for name, x in per_block.items() if x.size}
        return replace(self, norm=ratio * self.norm, **resized)  # type: ignore[arg-type]

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


def as_normal(t: FloatArray | float, freedom: FloatArray | float) -> FloatArray:
    """Convert Student's t to the standard normal variable of the same probability.

    Source: Wallace, Ann. Math. Statist. 30 (1959) 1121.

    >>> as_normal(3.143, 6.0).round(2), as_normal(-2.326, 1e9).round(3)  # one in a hundred: 2.326
    (np.float64(2.32), np.float64(-2.326))
    """
    n = np.asarray(freedom)
    return np.asarray(np.sign(t) * (8 * n + 1) / (8 * n + 3) * np.sqrt(n * np.log1p(np.square(t) / n)))


def from_normal(z: float, freedom: float) -> float:
    """Convert a standard normal variable, 0 or more, to Student's t of the same probability.

    >>> round(from_normal(2.32, 6.0), 2)
    3.14
    """
    n = freedom
    return float(np.sqrt(n * np.expm1((z * (8 * n + 3) / (8 * n + 1)) ** 2 / n)))


def noncentrality(t: float, freedom: float, power_quantile: float) -> float:
    """Return the noncentrality with which Student's t exceeds a value with the power of a normal quantile.

    The difference t s - z of the estimated standard deviation s, as a multiple of the true one, and a standard normal
    variable z counts as normal: mean and variance of s are exact, and a power of 90 % is met within 2 %.

    Source: Jennett and Welch, J. Royal Statist. Soc. Suppl. 6 (1939) 80.

    >>> from scipy.special import nctdtr
    >>> [round(1.0 - float(nctdtr(n, noncentrality(4.0, n, 1.2816), 4.0)), 2) for n in (2.0, 8.0, 40.0)]
    [0.89, 0.9, 0.9]
    """
    mean = float(np.sqrt(2.0 / freedom) * special.poch(0.5 * freedom, 0.5))
    return t * mean + power_quantile * float(np.sqrt(1.0 + t**2 * max(1.0 - mean**2, 0.0)))


def family_wise_test(
    results: Sequence[ScoreResult],
    settings: ScoreTestSettings,
    seed: int,
    tested: Sequence[ScoreResult] | None = None,
    *,
    jobs: int | None = 1,
) -> tuple[float, float]:
    """Test the best score against the maximum over the library, see `highest_scores_of_noise`.

    Parameters
    ----------
    results
        Score results of the whole library.
    settings
        Significance level and number of draws.
    seed
        Seed of the random weights.
    tested
        Results of which the best is tested, by default all; p is 1 where there are none.
    jobs
        Number of threads; None for all.

    Returns
    -------
    tuple of float
        Family-wise p, and the critical score at the significance level.
    """
    tested = results if tested is None else tested
    if not tested:
        return 1.0, np.inf
    highest = highest_scores_of_noise(results, settings, seed, jobs=jobs)
    return family_wise_p(highest, tested), float(np.quantile(highest, 1.0 - settings.significance_level))


def family_wise_p(highest: FloatArray, tested: Sequence[ScoreResult]) -> float:
    """Probability that the highest score [draw] of a library in noise is no less than the best of some results."""
    best = max(s.z if s.candidate.is_one_sided else abs(s.z) for s in tested)
    return (1 + int(np.sum(highest >= best))) / (1 + len(highest))


def highest_scores_of_noise(
    results: Sequence[ScoreResult], settings: ScoreTestSettings, seed: int, *, jobs: int | None = 1
) -> FloatArray:
    """Draw the highest score [draw] of a library under the null hypothesis, by a wild bootstrap of the blocks.

    The noise of every block is multiplied by a random sign; of fewer than 12 blocks, whose signs have too few patterns
    for a small p, by one of six numbers. Parameters as for `family_wise_test`.

    References
    ----------
    Webb, Reworking wild bootstrap-based inference for clustered errors, Canadian J. Economics 56 (2023) 839.
    """
    noise = np.array([s.residual_scores for s in results])
    noise /= np.maximum(np.linalg.norm(noise, axis=1, keepdims=True), 1e-300)
    is_one_sided = np.array([s.candidate.is_one_sided for s in results])
    rng = np.random.default_rng(np.random.SeedSequence([seed, 11]))
    points = [-1.0, 1.0] if noise.shape[1] >= FEW_BLOCKS else [*-SIX_POINTS, *SIX_POINTS]
    weights = rng.choice(points, size=(settings.bootstrap_draws, noise.shape[1]))
    h = np.array([s.leverage for s in results])
    w = 1.0 / np.maximum(1.0 - h, LONELY) ** 2
    freedom = np.array([s.degrees_of_freedom for s in results])

    def highest_scores(weights: FloatArray) -> FloatArray:
        """Highest score [draw] of noise with weights [draw, block]."""
        drawn = weights @ noise.T
        # each draw is divided by its own standard deviation, as the score is
        cross = weights @ (w * h * noise).T
        square = weights**2 @ (w * noise**2).T - 2 * drawn * cross + drawn**2 * np.sum(w * h * h, axis=1)
        for i, s in enumerate(results):
            if s.quadrature_scores.size:
                drawn[:, i], square[:, i] = _draw_with_phases(s, weights)
        drawn = as_normal(drawn / np.sqrt(np.maximum(square, LONELY)), freedom)
        return np.asarray(np.where(is_one_sided, drawn, np.abs(drawn)).max(axis=1))

    parts = np.array_split(weights, BOOTSTRAP_PARTS)  # as many with one thread: the digits are the same
    return np.concatenate(list(map_threads(highest_scores, parts, jobs)))


def _draw_with_phases(s: ScoreResult, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Scores [draw] of noise with weights [draw, block] at the phases that explain most, and their squared deviation.

    A periodic effect finds a phase for every segment in noise, too. With S and C the sums of the scores of a segment in
    phase and in quadrature, its score is the length of (S, C), and c_S, c_C are the direction. The score of all
    segments is D; the deviation of a block b is (c_S s_b + c_C q_b - h_b D) / (1 - h_b), whose squares are summed by
    products with the weights.
    """
    h, sd = s.leverage, max(s.standard_deviation, 1e-300)
    w = 1.0 / np.maximum(1.0 - h, LONELY) ** 2
    drawn, mixed, own = np.zeros((3, len(weights)))
    for segment in np.unique(s.segment_of_block):
        at = s.segment_of_block == segment
        leverage = h[at] / max(float(h[at].sum()), 1e-300)
        sine = s.residual_scores[at] / sd
        cosine = s.quadrature_scores[at] / (np.maximum(1.0 - leverage, LONELY) * sd)
        weight = w[at] * h[at]
        columns = np.stack([sine, cosine, weight * sine, weight * cosine], axis=1)
        some = weights if at.all() else weights[:, at]
        sums = some @ columns
        length = np.maximum(np.hypot(sums[:, 0], sums[:, 1]), 1e-300)
        in_phase, in_quadrature = sums[:, 0] / length, sums[:, 1] / length
        drawn += length
        mixed += in_phase * sums[:, 2] + in_quadrature * sums[:, 3]
        pairs = ((sine, sine), (cosine, cosine), (sine, cosine))
        squares = some**2 @ np.stack([w[at] * x * y for x, y in pairs], axis=1)
        own += in_phase**2 * squares[:, 0] + in_quadrature**2 * squares[:, 1]
        own += 2 * in_phase * in_quadrature * squares[:, 2]
    return drawn, own - 2 * drawn * mixed + drawn**2 * np.sum(w * h * h)
