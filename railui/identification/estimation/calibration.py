"""Calibration of the nominal model: its parameters estimated from the estimation runs, without any further effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.growing_windows import lengthen_windows, slips
from railui.identification.estimation.initial_state import estimate_phases
from railui.identification.estimation.multiple_shooting import (
    cut_into_windows,
    unstable_segments,
    windowed_growth_rate,
)
from railui.identification.estimation.output_error import COARSE_TOLERANCE, fit_output_error
from railui.identification.estimation.problem import prepare_segments, reprepare_segments
from railui.identification.prediction import SimulationError
from railui.vehicle.model import Model
from railui.vehicle.parameter import split_path

MAX_CONICITY_STEPS = 20


def with_phases(context: Context) -> Context:
    """Estimate the phases of rotating parts of the nominal model on each estimation run."""
    model = context.nominal
    for segment in context.dataset.estimation:
        model = estimate_phases(context, model, segment)
    return replace(context, nominal=model)


def calibrate(context: Context) -> Fit:
    """Estimate the parameters of the nominal model, then once more with weights and initial states renewed."""
    paths = context.campaign.estimated_parameters
    segments = context.dataset.estimation
    settings = context.settings
    bounded = context.nominal.limits_hunting
    start = stable_start(context)
    if start is not context.nominal:
        context.progress.message(
            "the nominal model is unstable at a speed of the campaign: the fit starts at a lower conicity"
        )
    cut = unstable_segments(context.nominal, segments, windowed_growth_rate(context)) if bounded else set()
    prepared = prepare_segments(context, start, cut_into_windows(segments, cut, settings.windows.window_duration))
    fit = fit_output_error(context, start, paths, segments=prepared, stable=not bounded, tolerance=COARSE_TOLERANCE)
    if cut and slips(context, fit):
        fit = _refit_from_short_windows(context, fit, start)
    if context.is_out_of_time:
        return fit
    context.progress.message(
        f"estimated {len(paths)} parameters in {fit.iterations} iterations; estimating again with renewed noise weights"
    )
    spent = fit.simulations
    prepared = reprepare_segments(context, fit.model, fit.segments)
    fit = fit_output_error(context, fit.model, paths, segments=prepared, stable=not bounded)
    return replace(fit, simulations=spent + fit.simulations)


def _refit_from_short_windows(context: Context, before: Fit, start: Model) -> Fit:
    """Fit a hunting vehicle that is out of step with the motion once more, from windows of two periods on."""
    context.progress.message("the model is out of step with the hunting: estimating on windows of growing length")
    windows = [t.segment for t in before.segments if t.is_window]
    runs = list({s.segment_key.name: s.window_of or s for s in windows}.values())
    quiet = context.in_background(context.jobs)
    paths, longest = before.free.paths, context.settings.windows.window_duration
    try:
        model, spent = lengthen_windows(quiet, start, paths, runs, longest)
        segments = prepare_segments(context, model, [t.segment for t in before.segments], like=before.segments)
        again = fit_output_error(context, model, paths, segments=segments, stable=False, tolerance=COARSE_TOLERANCE)
    except SimulationError as error:
        context.progress.message(f"  the first estimate is kept: {error}")
        return before
    better = again if again.normal.rss < before.normal.rss else before
    return replace(better, simulations=before.simulations + spent + again.simulations)


def calibrate_from(context: Context, before: Fit, model: Model) -> Fit | None:
    """Estimate the parameters of a calibrated model from those of a model with effects, which are left out.

    None where the misfit becomes no lower than before, or the vehicle diverges.
    """
    start = before.model.with_path_values(before.free.paths, np.array([model.value(p) for p in before.free.paths]))
    least = (1.0 - context.settings.score_test.structured_rho2) * before.normal.rss
    quiet = context.in_background(context.jobs)
    try:
        fit = fit_output_error(quiet, start, before.free.paths, segments=before.segments, misfit_limit=least)
        if fit.normal.rss > least:
            return None
        spent = before.simulations + fit.simulations
        segments = reprepare_segments(quiet, fit.model, fit.segments)
        fit = fit_output_error(context, fit.model, before.free.paths, segments=segments)
    except SimulationError:
        return None
    return replace(fit, simulations=spent + fit.simulations)


def fit_without_iteration(context: Context, model: Model) -> Fit:
    """Return a model as a fit to the estimation runs whose estimates are its own parameters."""
    return fit_output_error(context, model, context.campaign.estimated_parameters, max_iterations=0)


def stable_start(context: Context) -> Model:
    """Return the nominal model, or one of lower conicity that is stable at every speed of the estimation runs.

    The lowest conicity that is tried may leave it unstable. A model whose hunting an effect limits need not be stable.
    """
    model, settings = context.nominal, context.settings.calibration
    if not model.design.is_on_track or model.limits_hunting:
        return model
    conicities = [
        p for p in model.design.values if p.startswith("contact.") and split_path(p)[1].startswith("conicity")
    ]
    for _ in range(MAX_CONICITY_STEPS if conicities else 0):
        if not unstable_segments(model, context.dataset.estimation, settings.max_growth_rate):
            break
        lower = np.array([settings.conicity_step * model.design.values[c] for c in conicities])
        model = model.with_path_values(conicities, lower)
    return model
