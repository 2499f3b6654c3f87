"""Score test of the candidates of a model: which are scored, on which part of the runs, and if noise explains it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from railui.campaign.settings.detection import ScoreTestSettings
from railui.identification.context import Context, OutOfTimeError
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.initial_state import estimate_initial_state
from railui.identification.estimation.problem import FitSegment, truncate
from railui.identification.prediction import DivergedError
from railui.identification.structure.candidates import Candidate, list_candidates
from railui.identification.structure.family_wise_test import family_wise_test
from railui.identification.structure.preselection import preselect, ranked, undecided, with_best_shapes
from railui.identification.structure.score_result import ScoreResult
from railui.identification.structure.score_test import ScoreTest, ScoreTestResult
from railui.parallel import run_both

NO_SCORE_TEST = ScoreTestResult((), (), 1.0, float("inf"), 0.0)


def score_test(
    context: Context, fit: Fit, candidates: Sequence[Candidate], *, first: Sequence[FitSegment] = ()
) -> ScoreTestResult:
    """Score every candidate against the residual of a fit.

    With `first`, shortened segments, all candidates are scored on these and only the best on the segments of the fit.
    The results of the others are extrapolated and rank behind all of these: chance correlates more with fewer samples.
    """
    settings = context.settings.score_test
    others = tuple[ScoreResult, ...]()
    limit = settings.max_preselection_share * sum(t.measured.size for t in fit.segments)
    if not first or sum(t.measured.size for t in first) >= limit:
        full = ScoreTest(context, fit, fit.segments)
        selected = full.run(candidates)
    else:
        preselection, full = run_both(
            lambda: preselect(context, fit, candidates, first),
            lambda: ScoreTest(context, fit, fit.segments),
            context.jobs,
        )
        best = {s.candidate for s in ranked(preselection)[: settings.preselected_candidates]}
        best |= undecided(candidates, preselection, settings.min_remaining_share)
        selected = full.run([c for c in with_best_shapes(context, fit, candidates, preselection) if c in best])
        ratio = sum(t.measured.size for t in fit.segments) / sum(t.measured.size for t in first)
        others = tuple(s.extrapolate(ratio, full.block_count) for s in preselection if s.candidate not in best)
    results = (*selected, *others)
    p, critical_score = family_wise_test(results, settings, context.seed, selected, jobs=context.jobs)
    best_first = (*ranked(selected), *ranked(others))
    return ScoreTestResult(results, best_first, p, critical_score, full.projector.rss, settings)


def run_score_test(context: Context, fit: Fit) -> ScoreTestResult:
    """Score every candidate against the residual of a fit.

    No result where the time budget ends before, or where the vehicle diverges next to its estimates.
    """
    try:
        return _score_candidates(context, fit)
    except OutOfTimeError:
        return NO_SCORE_TEST
    except DivergedError as error:
        context.progress.message(f"no score test: {error}")
        return NO_SCORE_TEST


def _score_candidates(context: Context, fit: Fit) -> ScoreTestResult:
    context.check_time()
    loaded = context.campaign.track == "loaded"
    segments = context.dataset.estimation
    # at rest a rig that swings freely would not move, nor would a vehicle without excitation
    is_rig = fit.model.design.form == "rig"
    starts = [estimate_initial_state(context, fit.model, s) if is_rig or s.is_free else None for s in segments]
    candidates = list_candidates(fit.model, segments, without=context.excluded, loaded=loaded, starts=starts)
    part = scored_part(context, fit)
    first = truncate(context, part.segments, context.settings.score_test.preselection_duration)
    result = score_test(context, part, candidates, first=first)
    context.progress.message(
        f"score test: {len(result.best)} candidates, best partial rho^2 {result.rho2:.3f}, family-wise p {result.p:.4f}"
    )
    context.progress.event(result)
    return result


def scored_part(context: Context, fit: Fit) -> Fit:
    """First part of the runs of a fit, on which candidates are scored."""
    duration = context.settings.score_test.score_duration
    return replace(fit, segments=tuple(truncate(context, fit.segments, duration)))


def has_structure(settings: ScoreTestSettings, result: ScoreTestResult) -> bool:
    """True where the residual has a structure that noise does not have."""
    return structured_candidate(settings, result) is not None


def structured_candidate(settings: ScoreTestSettings, result: ScoreTestResult) -> ScoreResult | None:
    """Return the best candidate that explains a structure which noise does not have; None where there is none.

    It explains an obvious share of the residual, or a smaller one with a significant score of its own: the largest
    share of a library is often that of another candidate than the most significant score. Scores of a part of the runs
    are no evidence.
    """
    for s in result.best:
        if s.is_extrapolated:
            continue
        rho2 = s.admissible_rho**2
        if rho2 >= settings.obvious_rho2 or (rho2 >= settings.structured_rho2 and result.is_significant(s)):
            return s
    return None
