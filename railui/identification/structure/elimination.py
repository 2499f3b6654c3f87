"""Backward elimination of effects without which neither the validation error nor the misfit is clearly higher."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import drop_states
from railui.identification.estimation.validation import is_significant_gain
from railui.identification.prediction import DivergedError
from railui.identification.structure.candidates import Candidate, candidate_text
from railui.identification.structure.refit import Refit
from railui.identification.structure.stage import SelectionStep, Stage, gains, validated_stage
from railui.parallel import map_threads
from railui.vehicle.model import Model

REMOVAL_TOLERANCE = 1e-4


def remove_superfluous(
    context: Context, final: Stage, steps: list[SelectionStep], previous: Stage | None, finish: Callable[[Fit], Fit]
) -> Stage:
    """Remove the least needed effect until all are needed, see `_is_needed`; updates `steps`.

    previous: the model before the last effect was added; None where it was one of a pair, of which each is tested
    without the other.
    finish: fits a model to the end.
    """
    while not context.is_out_of_time:
        added = [i for i, s in enumerate(steps) if s.added]
        if len(added) < 2:
            break
        fitted = added if previous is None else added[:-1]
        background = context.in_background(1 if len(fitted) > 1 else context.jobs)
        without = map_threads(
            partial(_without_effect, background, final.fit), [steps[i].added for i in fitted], context.jobs
        )
        needless: list[tuple[int, Stage]] = []
        for i, stage in zip(added, [*without, *([] if previous is None else [previous])], strict=True):
            if stage is None:
                continue
            context.progress.message(f"  without {refit_text(steps[i].added)}: NRMSE {stage.validation.nrmse:.4f}")
            if not _is_needed(context, stage, final):
                needless.append((i, stage))
        removed = _least_needed(context, final, needless, previous, finish)
        if removed is None:
            break
        i, final = removed
        previous, steps[i] = None, replace(steps[i], added=None)
    return final


def _least_needed(
    context: Context,
    final: Stage,
    needless: Sequence[tuple[int, Stage]],
    previous: Stage | None,
    finish: Callable[[Fit], Fit],
) -> tuple[int, Stage] | None:
    """Return the step of the least needed effect and the model without it, fitted to the end.

    None where the validation error of all these models, once fitted to the end, is significantly higher than with the
    effect. Their misfits are not compared: the last fit has other weights, and may have other windows. The model of
    `previous` has been fitted to the end.
    """
    for i, stage in sorted(needless, key=lambda one: np.nan_to_num(one[1].validation.nrmse, nan=np.inf)):
        if stage is previous:
            return i, stage
        finished = _finished(context, stage.fit, finish)
        if finished is not None and not _has_larger_error(context, finished, final):
            return i, finished
    return None


def _has_larger_error(context: Context, without: Stage, final: Stage) -> bool:
    """True where the validation error is significantly larger without an effect, or the vehicle diverges there."""
    return _diverges(without, final) or is_significant_gain(context, without.validation, final.validation)


def _diverges(without: Stage, final: Stage) -> bool:
    """True where the vehicle diverges on a validation run without an effect, and with it does not."""
    return bool(np.isfinite(final.validation.nrmse) and not np.isfinite(without.validation.nrmse))


def _finished(context: Context, fit: Fit, finish: Callable[[Fit], Fit]) -> Stage | None:
    """Fit a model to the end and validate it; None where the vehicle diverges next to the estimate."""
    try:
        return validated_stage(context, finish(fit))
    except DivergedError:
        return None


def remove_undetermined(
    context: Context, final: Stage, steps: list[SelectionStep], finish: Callable[[Fit], Fit]
) -> Stage:
    """Remove effects of which the data determine no number, the least determined first; updates `steps`.

    Such an effect only balances another: it is collinear with it or with estimated parameters. The model without it is
    fitted to the end; it stays where that cannot be, and where it is the only effect.

    finish: fits a model to the end.
    """
    tried: set[int] = set()
    while not context.is_out_of_time:
        left = [i for i, s in enumerate(steps) if s.added]
        spreads = {i: _least_spread(final.fit, steps[i].added) for i in left if i not in tried}
        undetermined = [i for i, spread in spreads.items() if spread >= 1.0]
        if len(left) < 2 or not undetermined:
            break
        i = max(undetermined, key=lambda i: spreads[i])
        tried.add(i)
        without = _without_effect(context, final.fit, steps[i].added, misfit_limit=np.inf)
        stage = None if without is None else _finished(context, without.fit, finish)
        if stage is None or not np.isfinite(stage.validation.nrmse):
            continue
        context.progress.message(
            f"  {refit_text(steps[i].added)} is not determined; without it: NRMSE {stage.validation.nrmse:.4f}"
        )
        steps[i], final = replace(steps[i], added=None), stage
    return final


def _least_spread(fit: Fit, refit: Refit | None) -> float:
    """Least ratio of standard deviation to value among the estimated numbers of an effect; 0 where it has none."""
    candidate = None if refit is None else refit.candidate
    index = None if candidate is None else effect_index(fit.model, candidate)
    numbers = [
        (abs(x), sd)
        for path, x, sd in zip(fit.free.paths, fit.x, fit.sd, strict=True)
        if path.startswith(f"effects.{index}.") and "@" not in path
    ]
    return min((float(sd / max(x, 1e-300)) for x, sd in numbers), default=0.0)


def _is_needed(context: Context, without: Stage, final: Stage) -> bool:
    """True where the validation error is significantly higher without an effect, or the misfit obviously.

    A validation run of few blocks shows a small gain as significant only where all blocks agree; the misfit of the
    estimation runs decides where the validation error is not lower without the effect. It is needed where the vehicle
    without it diverges on a validation run, and with it does not.
    """
    if _diverges(without, final) or gains(context, without, final):
        return True
    without_it = without.fit.normal.misfit_per_sample
    is_obvious = without_it >= _obvious_misfit(context, final.fit)
    return is_obvious and final.validation.nrmse <= without.validation.nrmse


def _obvious_misfit(context: Context, fit: Fit) -> float:
    """Misfit per sample without an effect from which the effect is obvious."""
    return fit.normal.misfit_per_sample / (1.0 - context.settings.score_test.obvious_rho2)


def _without_effect(context: Context, fit: Fit, refit: Refit | None, misfit_limit: float | None = None) -> Stage | None:
    """Fit and validate the model without one of its effects; None where it cannot be fitted.

    misfit_limit: of the fit, which is given up where it will not come below; by default that of an obvious effect.
    """
    candidate = None if refit is None else refit.candidate
    index = None if candidate is None else effect_index(fit.model, candidate)
    if index is None:
        return None
    model = fit.model.without_effect(index)
    paths = [*context.campaign.estimated_parameters, *model.effect_paths()]
    try:
        segments = drop_states(context, fit.model, model, fit.segments)
        limit = misfit_limit
        if limit is None:
            limit = _obvious_misfit(context, fit) * sum(t.measured.size for t in segments)
        without = fit_output_error(
            context, model, paths, segments=segments, tolerance=REMOVAL_TOLERANCE, misfit_limit=limit
        )
    except DivergedError:
        return None
    return validated_stage(context, without)


def effect_index(model: Model, c: Candidate) -> int | None:
    """Index of a candidate among the effects of a model; None where it has none such."""
    same = [i for i, e in enumerate(model.effects) if (e.kind, e.at, e.wheelset) == (c.kind, c.at, c.wheelset)]
    return same[0] if same else None


def refit_text(refit: Refit | None) -> str:
    """Describe the effect of a refit in words."""
    return "nothing" if refit is None or refit.candidate is None else candidate_text(refit.candidate)
