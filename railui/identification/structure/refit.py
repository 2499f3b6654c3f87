"""Candidate refit: the candidates with the best scores are fitted together with all parameters, and compared."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol, TypeVar

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.comparison import overall_nrmse
from railui.campaign.settings.detection import RefitSettings
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import MAX_ITERATIONS
from railui.identification.estimation.leave_one_out import change_of_estimates
from railui.identification.estimation.problem import FitSegment, adapt_to_model, channel_power
from railui.identification.prediction import DivergedError, SimulationError
from railui.identification.structure.candidates import Candidate, candidate_text
from railui.identification.structure.score_result import ScoreResult
from railui.identification.structure.score_test import ScoreTestResult
from railui.identification.structure.screening import Screened, ScreeningFits, fit_with_effects, has_states
from railui.parallel import map_threads

RANKING_SEED = 13
S = TypeVar("S")


class WithMisfit(Protocol):
    """Result with a misfit on the estimation runs."""

    @property
    def rss(self) -> float: ...


R = TypeVar("R", bound=WithMisfit)


@dataclass(frozen=True, eq=False)
class Refit:
    """A candidate (None: no effect) fitted to the estimation runs, and its cross-validated errors [block, channel]."""

    candidate: Candidate | None
    fit: Fit
    block_errors: FloatArray
    score_result: ScoreResult | None = None

    @property
    def rss(self) -> float:
        """Misfit on the estimation runs."""
        return self.fit.normal.rss


def select_candidates(settings: RefitSettings, scores: ScoreTestResult, *, every: bool = False) -> list[ScoreResult]:
    """Select the candidates to fit; all of them where there are few (`every`).

    The best five, all near the best, effects with internal states down to lower scores, and the related laws of
    the best candidate at its location.
    """
    if every:
        return list(scores.best)
    selected: list[ScoreResult] = []
    for i, s in enumerate(scores.best):
        share = s.admissible_rho**2 / max(scores.rho2, 1e-300)
        limit = settings.refit_share_memory if has_states(s.candidate) else settings.refit_share
        is_near = share >= limit and len(selected) < settings.max_refitted
        if i < settings.always_refitted or is_near or scores.best[0].candidate.is_related(s.candidate):
            selected.append(s)
    return [s for s in selected if s.admissible_rho > 0]


def refit_candidates(
    context: Context, fit: Fit, scores: ScoreTestResult, *, with_absorbed: bool = False
) -> list[Refit]:
    """Fit the candidates with the best scores, those near the least misfit to convergence; return the best first.

    None is fitted where the vehicle without effect diverges on the first part of the runs: no misfit is known then.

    with_absorbed: fit springs and dampers that estimation absorbs as well, where much is left on the validation runs.
    """
    settings, progress = context.settings.refit, context.progress
    try:
        screening = ScreeningFits(context, fit)
    except DivergedError as error:
        progress.message(f"no candidate is fitted: {error}")
        return []
    selected = select_candidates(settings, scores, every=fit.model.design.kind == "rig")
    for s in selected:
        progress.event(s)
    screened = screening.fit_candidates(scores, selected)
    for s, f in screened:
        share = f.normal.rss / screening.rss_without_effect
        progress.message(
            f"  {candidate_text(s.candidate):48s} rho {s.rho:+.3f}   misfit {share:.4f} of that without effect"
        )
    if with_absorbed and not screening.is_settled:
        screened += screening.fit_absorbed_elements(scores, selected)
    if not screened:
        return []
    limit = settings.converged_ratio * min(f.normal.rss for _, f in screened)
    several = sum(f.normal.rss <= limit for _, f in screened) > 1
    background = context.in_background(1 if several else context.jobs)
    tolerance = settings.comparison_tolerance if several else settings.refit_tolerance

    def refit(misfit_limit: float | None, item: Screened) -> Refit | None:
        """Continue a screening fit on the complete runs: to convergence near the least misfit, else evaluate it."""
        s, f = item
        is_close = f.normal.rss <= limit and misfit_limit is not None
        final = continue_on_whole_runs(
            background,
            f,
            fit.segments,
            tolerance=tolerance,
            misfit_limit=misfit_limit if is_close else None,
            max_steps=None if is_close else screening.max_steps,
        )
        return None if final is None else Refit(s.candidate, final, cross_validation_errors(settings, final), s)

    refits = list[Refit]()
    for done in refit_leading_first(context, fit, screened, limit, refit):
        refits.append(done)
        progress.event(done)
    return sorted(refits, key=lambda r: r.rss)


def worthwhile_misfit(context: Context, fit: Fit) -> float:
    """Return the misfit from which an effect added to a fit takes too little to gain or to be tried."""
    settings = context.settings.selection
    share = min(settings.trial_misfit_share, settings.worthwhile_gain_share * context.campaign.min_gain)
    return float((1.0 - share) * fit.normal.rss)


def refit_leading_first(
    context: Context,
    fit: Fit,
    screened: Sequence[tuple[S, Fit]],
    limit: float,
    refit: Callable[[float | None, tuple[S, Fit]], R | None],
    misfit_limit: float | None = np.inf,
) -> Iterator[R]:
    """Refit the leading screening fits and those above a misfit, then the others, with a limit from the former.

    Parameters
    ----------
    fit
        The fit to which effects are added; where the leading ones take too little of its misfit, the others are only
        evaluated.
    limit
        Misfit of a screening fit above which it is not continued.
    refit
        Continue a screening fit whose misfit on the complete runs must come below a limit, or evaluate it where the
        limit is None; None where it cannot be.
    misfit_limit
        Limit for the leading ones.
    """
    settings = context.settings.refit
    by_rss = sorted(screened, key=lambda item: item[1].normal.rss)
    close = [item for item in by_rss if item[1].normal.rss <= limit]
    leading, following = close[: settings.leading_candidates], close[settings.leading_candidates :]
    others = [item for item in screened if item[1].normal.rss > limit]
    least = np.inf
    for some in ([*leading, *others], following):
        for done in map_threads(partial(refit, misfit_limit), some, context.jobs):
            if done is not None:
                least = min(least, done.rss)
                yield done
        misfit_limit = settings.given_up_ratio * least if least <= worthwhile_misfit(context, fit) else None


def continue_on_whole_runs(
    context: Context,
    screened: Fit,
    whole: Sequence[FitSegment],
    *,
    tolerance: float,
    misfit_limit: float | None,
    max_steps: int | None = None,
) -> Fit | None:
    """Continue a screening fit, all parameters free, on the complete runs; None where it cannot be simulated there.

    misfit_limit: as for `fit_output_error`; None: evaluate the fit, without an iteration.
    """
    model = screened.model
    try:
        segments = adapt_to_model(context, model, whole, max_steps)
    except SimulationError:
        return None  # too stiff to be simulated over whole runs
    if model.design.kind == "rig":  # the screening fit has the better initial state
        starts = {_start_key(t): t.initial_state for t in screened.segments}
        segments = [t.with_start(starts.get(_start_key(t), t.initial_state)) for t in segments]
    return fit_with_effects(
        context,
        model,
        segments,
        [*context.campaign.estimated_parameters, *model.effect_paths()],
        tolerance=tolerance,
        max_iterations=0 if misfit_limit is None else MAX_ITERATIONS,
        misfit_limit=np.inf if misfit_limit is None else misfit_limit,
    )


def _start_key(target: FitSegment) -> tuple[str, int, int]:
    """File, segment and first sample: where a segment or window starts."""
    return target.segment.file, target.segment.number, target.segment.first_sample


def simplest_refit(refits: Sequence[Refit], misfit_ratio: float) -> Refit | None:
    """Select the refit with fewest parameters among those whose misfit is within a ratio of the best."""
    if not refits:
        return None
    near = [r for r in refits if r.rss <= misfit_ratio * refits[0].rss]
    return min(near, key=lambda r: (len(r.fit.x), _is_on_one_wheelset(r.candidate), r.rss))


def _is_on_one_wheelset(candidate: Candidate | None) -> bool:
    """True for an effect on a single wheelset: one on both comes first."""
    return candidate is not None and candidate.wheelset is not None


def cross_validation_errors(settings: RefitSettings, fit: Fit) -> FloatArray:
    """Squared misfit [block, channel] of each block with parameters estimated on the other folds, to first order."""
    gram = fit.normal.gram
    total = fit.normal.total
    errors = np.zeros(gram.shape[:2])
    for fold in np.array_split(np.arange(len(gram)), min(settings.cross_validation_folds, len(gram))):
        shift = change_of_estimates(fit, total - gram[fold].sum(axis=(0, 1)), fit.least_squares)
        g = gram[fold]
        quadratic = np.einsum("p,bcpq,q->bc", shift, g[..., 1:, 1:], shift)
        errors[fold] = g[..., 0, 0] - 2 * g[..., 0, 1:] @ shift + quadratic
    return errors


def cross_validation_nrmse(refit: Refit) -> float:
    """Cross-validated NRMSE on the estimation runs."""
    power = channel_power(refit.fit.segments)
    errors = zip(power, refit.block_errors.sum(axis=0), strict=True)
    return overall_nrmse({c: float(np.sqrt(error / power[c])) for c, error in errors})


def bootstrap_weights(settings: RefitSettings, refits: Sequence[Refit], seed: int) -> FloatArray:
    """Share of block bootstraps in which each fit was best [refit]."""
    blocks = np.array([r.block_errors.sum(axis=1) for r in refits])
    rng = np.random.default_rng(np.random.SeedSequence([seed, RANKING_SEED]))
    drawn = rng.integers(0, blocks.shape[1], size=(settings.ranking_draws, blocks.shape[1]))
    best = np.argmin(blocks[:, drawn].sum(axis=2), axis=0)
    return np.bincount(best, minlength=len(refits)) / settings.ranking_draws
