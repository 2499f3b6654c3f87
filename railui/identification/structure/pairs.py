"""Pairs of effects: what two of them explain together, from inner products of their projected output differences.

A greedy search fails where either effect alone explains little or makes the unseen runs worse, and both together
explain the residual: friction and quadratic drag change the damping of a decay in opposite directions. With s the
scores and G the Gram matrix of two projected differences, the pair explains s' G^-1 s of the residual sum of squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations

import numpy as np

from railui.arrays import FloatArray
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.prediction import DivergedError
from railui.identification.structure.candidates import Candidate, batches_on, candidate_text
from railui.identification.structure.refit import continue_on_whole_runs, refit_leading_first
from railui.identification.structure.score_result import ScoreResult
from railui.identification.structure.score_test import ScoreTest, ScoreTestResult
from railui.identification.structure.screening import ScreeningFits, scaled_shape
from railui.parallel import map_threads


@dataclass(frozen=True)
class PairSearch:
    """Number of pairs that were scored, and of those that were refitted."""

    scored: int
    refitted: int


@dataclass(frozen=True, eq=False)
class PairScore:
    """Two shapes at the amounts that together explain the residual best, and the share of it that they explain."""

    first: ScoreResult
    second: ScoreResult
    rho2: float

    @property
    def candidates(self) -> tuple[Candidate, Candidate]:
        """The two effects."""
        return self.first.candidate, self.second.candidate

    @property
    def text(self) -> str:
        """The two effects in words."""
        return " and ".join(candidate_text(c) for c in self.candidates)


@dataclass(frozen=True, eq=False)
class PairRefit:
    """A pair fitted together with all parameters."""

    score: PairScore
    fit: Fit

    @property
    def rss(self) -> float:
        """Misfit on the estimation runs."""
        return self.fit.normal.rss


def select_shapes(scores: ScoreTestResult, count: int, of_candidate: int) -> list[ScoreResult]:
    """Select shapes for pairs: the best of every candidate, then further shapes in the order of their scores.

    Those that are extrapolated from a part of the runs are behind all others, since chance raises their scores more.
    A candidate of no or the wrong sign alone may be half of the best pair; one with a phase is left out.
    of_candidate: shapes of a candidate, at most.
    """
    best = [s for s in scores.best if not s.candidate.has_phase]
    others: list[ScoreResult] = []
    shapes: dict[Candidate, int] = {}
    for s in sorted(scores.results, key=_order):
        if s in best or s.candidate.has_phase:
            continue
        shapes[s.candidate] = shapes.get(s.candidate, 1) + 1
        if shapes[s.candidate] <= of_candidate:
            others.append(s)
    return [*sorted(best, key=_order), *others][:count]


def _order(s: ScoreResult) -> tuple[bool, float]:
    return s.is_extrapolated, -abs(s.rho)


def score_pairs(test: ScoreTest, scores: ScoreTestResult) -> tuple[list[PairScore], int]:
    """Score all pairs of the best shapes; return the best of each two effects in descending order, and their number.

    Only the shapes themselves are simulated, none of the pairs.
    """
    settings = test.context.settings.selection
    shapes = select_shapes(scores, settings.pair_shapes, settings.pair_shapes_of_candidate)
    shapes, gram, score = projected_gram(test, shapes)
    best: dict[tuple[Candidate, Candidate], PairScore] = {}
    scored = 0
    for i, j in combinations(range(len(shapes)), 2):
        if shapes[i].candidate == shapes[j].candidate:
            continue
        scored += 1
        pair = _score_pair(shapes[i], shapes[j], gram[np.ix_([i, j], [i, j])], score[[i, j]], test)
        if pair is not None and (pair.candidates not in best or pair.rho2 > best[pair.candidates].rho2):
            best[pair.candidates] = pair
    return sorted(best.values(), key=lambda p: -p.rho2), scored


def _score_pair(
    a: ScoreResult, b: ScoreResult, gram: FloatArray, score: FloatArray, test: ScoreTest
) -> PairScore | None:
    """Score a pair; None where the two are alike, or where either would have the wrong sign."""
    product = gram[0, 0] * gram[1, 1]
    if product <= 0 or 1.0 - gram[0, 1] ** 2 / product < test.context.settings.selection.min_pair_difference:
        return None
    amounts = np.linalg.solve(gram, score)
    if any(s.candidate.is_one_sided and x <= 0 for s, x in zip((a, b), amounts, strict=True)):
        return None
    rho2 = float(score @ amounts / max(test.projector.rss, 1e-300))
    return PairScore(replace(a, amount=float(amounts[0])), replace(b, amount=float(amounts[1])), rho2)


def projected_gram(test: ScoreTest, shapes: Sequence[ScoreResult]) -> tuple[list[ScoreResult], FloatArray, FloatArray]:
    """Compute inner products [n, n] of projected output differences, and their scores [n], of the valid shapes."""
    by_candidate: dict[Candidate, list[ScoreResult]] = {}
    for s in shapes:
        by_candidate.setdefault(s.candidate, []).append(s)
    reduced = [replace(c, shapes=tuple(c.shapes[s.shape] for s in some)) for c, some in by_candidate.items()]
    batches = batches_on(test.fit.model, reduced)
    results, rows = [], []
    for batch, (series, is_valid) in zip(
        batches, map_threads(test.differences, batches, test.context.jobs), strict=True
    ):
        for lane, (member, shape) in enumerate(batch.lanes):
            if is_valid[lane]:
                results.append(by_candidate[batch.members[member]][shape])
                rows.append([x[lane] for x in series])
    if not rows:
        return [], np.zeros((0, 0)), np.zeros(0)
    gram, score = test.gram([np.stack(segment) for segment in zip(*rows, strict=True)])
    return results, gram, score


def refit_pairs(
    context: Context,
    fit: Fit,
    pairs: Sequence[PairScore],
    max_share: float = np.inf,
    misfit_limit: float = np.inf,
) -> list[PairRefit]:
    """Fit the best pairs together with all parameters, those near the least misfit to convergence; the best first.

    None is fitted where the vehicle without them diverges on the first part of the runs.

    Parameters
    ----------
    max_share
        Misfit on the first part of the runs, over that without the pairs, above which a pair is given up.
    misfit_limit
        Misfit on the complete runs below which a pair must come.
    """
    try:
        screening = ScreeningFits(context, fit)
    except DivergedError as error:
        context.progress.message(f"no pair is fitted: {error}")
        return []
    screened = []
    for pair, f in zip(pairs, map_threads(lambda p: _screen(screening, p), pairs, context.jobs), strict=True):
        if f is not None:
            share = f.normal.rss / screening.rss_without_effect
            context.progress.message(
                f"  {pair.text:64s} rho^2 {pair.rho2:.3f}   misfit {share:.4f} of that without them"
            )
            if share <= max_share:
                screened.append((pair, f))
    limit = context.settings.refit.converged_ratio * min((f.normal.rss for _, f in screened), default=0.0)
    close = [item for item in screened if item[1].normal.rss <= limit]
    refits = refit_leading_first(context, fit, close, limit, partial(_refit, context, fit), misfit_limit)
    return sorted(refits, key=lambda r: r.rss)


def _screen(screening: ScreeningFits, pair: PairScore) -> Fit | None:
    """Fit a pair on the first part of the runs from its amounts."""
    settings = screening.settings
    points = [s.candidate.effect_with(scaled_shape(settings, s)) for s in (pair.first, pair.second)]
    return screening.fit_together(points)


def _refit(context: Context, fit: Fit, misfit_limit: float | None, item: tuple[PairScore, Fit]) -> PairRefit | None:
    """Continue the screening fit of a pair on the complete runs."""
    pair, screened = item
    final = continue_on_whole_runs(
        context.in_background(1),
        screened,
        fit.segments,
        tolerance=context.settings.refit.comparison_tolerance,
        misfit_limit=misfit_limit,
    )
    return None if final is None else PairRefit(pair, final)


def simplest_pair(refits: Sequence[PairRefit], misfit_ratio: float) -> PairRefit | None:
    """Select the pair with fewest parameters among those whose misfit is within a ratio of the best."""
    near = [r for r in refits if r.rss <= misfit_ratio * refits[0].rss]
    return min(near, key=lambda r: (len(r.fit.x), r.rss), default=None)
