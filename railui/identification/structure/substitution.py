"""Substitution: the model with another effect in place of one of its effects, fitted and validated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import MAX_ITERATIONS
from railui.identification.estimation.problem import adapt_to_model, drop_states
from railui.identification.prediction import SimulationError
from railui.identification.structure.elimination import refit_text
from railui.identification.structure.refit import Refit, cross_validation_errors
from railui.identification.structure.screening import fit_with_effects
from railui.identification.structure.stage import SelectionStep, Stage, validated_stage
from railui.io.problems import FileProblems
from railui.vehicle.effects import PlacedEffect


def substitute(
    context: Context,
    final: Stage,
    steps: list[SelectionStep],
    finish: Callable[[Fit], Fit],
    find: Callable[[Fit, int], Refit | None],
    max_error_ratio: float,
) -> Stage:
    """Substitute another effect for each that is selected, where one is found; updates `steps`.

    Parameters
    ----------
    finish
        Fits a model to the end.
    find
        Returns the refit with another effect in place of that of a step in a fit; None: there is none as good.
    max_error_ratio
        Validation error with the other effect over that without it up to which it is taken.
    """
    if final.fit.slips or any(t.is_window for t in final.fit.segments):
        return final
    for i in [i for i, s in enumerate(steps) if s.added]:
        current = steps[i].added
        refit = None if context.is_out_of_time else find(final.fit, i)
        stage = None if refit is None else _validated(context, refit, finish)
        if refit is None or stage is None:
            continue
        text = f"{refit_text(refit)} in place of {refit_text(current)}"
        context.progress.message(f"  {text}: NRMSE {stage.validation.nrmse:.4f}")
        if stage.validation.nrmse <= max_error_ratio * final.validation.nrmse:
            alternatives = steps[i].alternatives
            if current is not None and all(r.candidate != refit.candidate for r in alternatives):
                alternatives = (refit, refit_of(context, final.fit, current))
            errors = cross_validation_errors(context.settings.refit, stage.fit)
            added = replace(refit, fit=stage.fit, block_errors=errors)
            steps[i], final = replace(steps[i], added=added, alternatives=alternatives), stage
    return final


def refit_of(context: Context, fit: Fit, current: Refit) -> Refit:
    """Return a fit as the refit of one of its effects, to be compared with fits that have another in its place."""
    return replace(current, fit=fit, block_errors=cross_validation_errors(context.settings.refit, fit))


def fit_in_place(context: Context, fit: Fit, index: int, effect: PlacedEffect, max_misfit_ratio: float) -> Fit | None:
    """Fit the model with another effect in place of one; None where its misfit is higher by more than a ratio.

    None as well where one of the other effects supersedes the same term. The effect at `index` is left out. A fit that
    is not near the misfit after its first iterations is given up.
    """
    quiet = context.in_background(context.jobs)
    settings = context.settings.refit
    model = fit.model.without_effect(index)
    segments = drop_states(quiet, fit.model, model, fit.segments)
    try:
        model, found = model.with_effect(effect), None
    except FileProblems:
        return None
    for iterations, ratio, limit in (
        (settings.first_iterations, settings.converged_ratio, np.inf),
        (MAX_ITERATIONS, max_misfit_ratio, max_misfit_ratio * fit.normal.rss),
    ):
        try:
            adapted = adapt_to_model(quiet, model, segments)
        except SimulationError:
            return None  # the law is too stiff to be simulated with these numbers
        paths = [*context.campaign.estimated_parameters, *model.effect_paths()]
        found = fit_with_effects(
            quiet,
            model,
            adapted,
            paths,
            tolerance=settings.comparison_tolerance,
            max_iterations=iterations,
            misfit_limit=limit,
        )
        if found is None or found.normal.rss > ratio * fit.normal.rss:
            return None
        model = found.model
    return found


def _validated(context: Context, refit: Refit, finish: Callable[[Fit], Fit]) -> Stage | None:
    """Fit a model to the end and validate it; None where it diverges."""
    try:
        return validated_stage(context, finish(refit.fit))
    except SimulationError:
        return None
