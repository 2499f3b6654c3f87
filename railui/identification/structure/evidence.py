"""What was seen of a candidate against the residual, and what noise alone would have shown of a whole library."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.identification.structure.candidates import Candidate

BOOTSTRAPS = 2000
LEAST_FREEDOM = 1.0
LONELY = 1e-6  # share of all other blocks below which one block is alone


@dataclass(frozen=True, eq=False)
class ScoreResult:
    """One shape of a candidate seen against the residual.

    rho: partial correlation; amount: of it that would explain the residual best; scores [block]: what each block of
    time says; norm: squared length of its difference, norms [block] the same of every block (empty: all alike);
    absorbed [p]: what the adjustable parameters make of one of it; own: share of the squared length that they leave;
    phases: the angle [rad] of what turns in the middle of each stretch, by which it explains most; beside [block]: the
    scores in quadrature to it, where [block]: the stretch of each block.
    """

    candidate: Candidate
    shape: int
    rho: float
    amount: float
    scores: FloatArray
    norm: float
    absorbed: FloatArray = field(default_factory=lambda: np.zeros(0), repr=False)
    norms: FloatArray = field(default_factory=lambda: np.zeros(0), repr=False)
    own: float = 1.0
    phases: Mapping[str, float] = field(default_factory=dict)
    beside: FloatArray = field(default_factory=lambda: np.zeros(0), repr=False)
    where: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64), repr=False)

    @property
    def z(self) -> float:
        """The score over its standard deviation from blocks (HAC), in standard deviations of a normal variable."""
        spread = self.spread
        return float(as_normal(self.scores.sum() / spread, self.freedom)) if spread > 0 else 0.0

    def forecast(self, ratio: float, blocks: int) -> ScoreResult:
        """What a run so many times as long, of so many blocks, would say."""
        per_block = {"scores": self.scores, "norms": self.norms, "beside": self.beside, "where": self.where}
        resized = {name: np.resize(x, blocks) for name, x in per_block.items() if x.size}
        return replace(self, norm=ratio * self.norm, **resized)  # type: ignore[arg-type]

    @property
    def leverage(self) -> FloatArray:
        """Share [block] of a block in what is known of the amount; an effect that acts now and then is in few."""
        if not self.norms.size:
            return np.full(len(self.scores), 1.0 / len(self.scores))
        return np.asarray(self.norms / max(self.norms.sum(), 1e-300))

    @property
    def noise(self) -> FloatArray:
        """Scores [block] less what the effect makes of them, its amount estimated without that block.

        s_b - a_b n_b with a_b = sum of the other s / sum of the other n, n_b the squared length in the block: the
        residuals of least squares left out one at a time, of which the variance is consistent whatever the noise
        (HC3: MacKinnon and White, J. Econometrics 29 (1985) 305). Scores less their mean would count it as noise
        that an effect speaks in few blocks and is silent in others.
        """
        h = self.leverage
        return np.asarray((self.scores - h * self.scores.sum()) / np.maximum(1.0 - h, LONELY))

    @property
    def freedom(self) -> float:
        """Degrees of freedom of the spread: blocks that speak, less one."""
        return max(float(1.0 / np.sum(self.leverage**2)) - 1.0, LEAST_FREEDOM)

    @property
    def spread(self) -> float:
        """Standard deviation of the score, from blocks."""
        return float(np.linalg.norm(self.noise))

    def amount_seen(self, z: float) -> float:
        """The amount whose score is so many standard deviations of a normal variable."""
        n = self.freedom
        t = float(np.sqrt(n * np.expm1((z * (8 * n + 3) / (8 * n + 1)) ** 2 / n)))
        return t * self.spread / self.norm


def as_normal(t: FloatArray | float, freedom: FloatArray | float) -> FloatArray:
    """Student's t as the normal variable of the same probability (Wallace, Ann. Math. Statist. 30 (1959) 1121).

    >>> as_normal(3.143, 6.0).round(2), as_normal(-2.326, 1e9).round(3)  # one in a hundred: 2.326
    (np.float64(2.32), np.float64(-2.326))
    """
    n = np.asarray(freedom)
    return np.asarray(np.sign(t) * (8 * n + 1) / (8 * n + 3) * np.sqrt(n * np.log1p(np.square(t) / n)))


def signed_rho(s: ScoreResult) -> float:
    """rho as evidence: one-sided candidates count a negative one as none."""
    return max(s.rho, 0.0) if s.candidate.one_sided else abs(s.rho)


def family_wise_test(
    sightings: Sequence[ScoreResult], seed: int, seen_well: Sequence[ScoreResult] | None = None
) -> tuple[float, float]:
    """p of the best score against the maximum over the library, and the critical score at 1 %.

    The best score is that of `seen_well` (all where None). Under "nothing missing" what noise says in the blocks is
    given random signs (wild bootstrap of blocks).
    """
    if not sightings:
        return 1.0, float("inf")
    noise = np.array([s.noise for s in sightings])
    spread = np.maximum(np.linalg.norm(noise, axis=1, keepdims=True), 1e-300)
    noise /= spread
    one = np.array([s.candidate.one_sided for s in sightings])
    well = sightings if seen_well is None else seen_well
    seen = np.array([s.z if s.candidate.one_sided else abs(s.z) for s in well])
    rng = np.random.default_rng(np.random.SeedSequence([seed, 11]))
    signs = rng.choice([-1.0, 1.0], size=(BOOTSTRAPS, noise.shape[1]))
    drawn = signs @ noise.T
    # each draw over its own spread, as the score that was seen is over its own
    h = np.array([s.leverage for s in sightings])
    w = 1.0 / np.maximum(1.0 - h, LONELY) ** 2
    square = (
        np.sum(w * noise**2, axis=1) - 2 * drawn * (signs @ (w * h * noise).T) + drawn**2 * np.sum(w * h * h, axis=1)
    )
    for i, s in enumerate(sightings):
        if s.beside.size:
            drawn[:, i], square[:, i] = _turned(s, signs)
    drawn = as_normal(drawn / np.sqrt(np.maximum(square, LONELY)), np.array([s.freedom for s in sightings]))
    highest = np.where(one, drawn, np.abs(drawn)).max(axis=1)
    p = (1 + int(np.sum(highest >= seen.max()))) / (1 + BOOTSTRAPS)
    return p, float(np.quantile(highest, 0.99))


def _turned(s: ScoreResult, signs: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Score [draw] of noise with signs [draw, block], and its squared spread, seen with the phases that suit each draw.

    What turns finds in noise, too, a phase for every stretch.
    """
    h, spread = s.leverage, max(s.spread, 1e-300)
    sine, drawn, turned = signs * s.noise / spread, np.zeros(len(signs)), np.zeros(signs.shape)
    for where in np.unique(s.where):
        at = s.where == where
        own = h[at] / max(float(h[at].sum()), 1e-300)
        cosine = signs[:, at] * s.beside[at] / (np.maximum(1.0 - own, LONELY) * spread)
        sums = np.stack([sine[:, at].sum(axis=1), cosine.sum(axis=1)])
        length = np.maximum(np.linalg.norm(sums, axis=0), 1e-300)
        turned[:, at] = (sums[0] / length)[:, None] * sine[:, at] + (sums[1] / length)[:, None] * cosine
        drawn += length
    rest = (turned - h * drawn[:, None]) / np.maximum(1.0 - h, LONELY)
    return drawn, np.asarray(np.sum(rest**2, axis=1))
