"""Family-wise test of the best score of a library against noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.settings.detection import ScoreTestSettings
from railui.identification.structure.score_result import LONELY, BlockScore
from railui.identification.structure.student import as_normal
from railui.parallel import map_threads

BOOTSTRAP_PARTS = 4  # of the draws, over threads
FEW_BLOCKS = 12  # below which random signs have too few patterns
SIX_POINTS = np.sqrt(np.array([0.5, 1.0, 1.5]))  # and their negatives: mean 0, variance 1


def family_wise_test(
    results: Sequence[BlockScore],
    settings: ScoreTestSettings,
    seed: int,
    tested: Sequence[BlockScore] | None = None,
    *,
    jobs: int | None = 1,
) -> tuple[float, float]:
    """Test the best score against the maximum over the library, see `highest_scores_of_noise`.

    Parameters
    ----------
    results
        Scores of the whole library.
    settings
        Significance level and number of draws.
    seed
        Seed of the random weights.
    tested
        Scores of which the best is tested, by default all; p is 1 where there are none.
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


def family_wise_p(highest: FloatArray, tested: Sequence[BlockScore]) -> float:
    """Probability that the highest score [draw] of a library in noise is no less than the best of some scores."""
    best = max(s.admissible_z for s in tested)
    return (1 + int(np.sum(highest >= best))) / (1 + len(highest))


def highest_scores_of_noise(
    results: Sequence[BlockScore], settings: ScoreTestSettings, seed: int, *, jobs: int | None = 1
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
    is_one_sided = np.array([s.is_one_sided for s in results])
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


def _draw_with_phases(s: BlockScore, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
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
