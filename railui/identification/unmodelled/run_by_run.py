"""Differences between the estimation runs: the model fitted to each run apart reaches noise, that of all runs does not.

Runs at other temperatures, loads or rails are not one vehicle. What is fitted to all of them leaves their difference,
which no effect explains, while each run alone is at its noise floor and one of the models holds on each validation run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.identification.estimation.covariance import interval_factor
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import FitSegment, reprepare_segments
from railui.identification.estimation.validation import Validation, validate, validate_each
from railui.identification.prediction import SimulationError
from railui.identification.structure.drift import parameter_groups
from railui.identification.unmodelled.condition_dependence import homogeneity
from railui.identification.unmodelled.run_dependence import RunDependence, RunEstimate
from railui.vehicle.model import Model

COMPARED_GROUPS = 4  # groups of parameters that differ most, refitted alone
FIT_TOLERANCE = 1e-4
RENEWALS = 5  # of the initial states, at most


class RunDifference(NamedTuple):
    """Models fitted to each estimation run apart, validated by the best of them on each validation run.

    dependence: the parameter that differs alone; None where no single one explains the difference.
    """

    validation: Validation
    dependence: RunDependence | None


def find_run_difference(context: Context, fit: Fit) -> RunDifference | None:
    """Fit the model of a fit to each estimation run apart; None unless each of them is at its noise floor.

    No parameter is fitted to the validation runs.
    """
    by_run: dict[int, list[FitSegment]] = {}
    for target in fit.segments:
        by_run.setdefault(target.segment.run_index, []).append(target)
    is_adequate = fit.error_to_noise <= context.settings.selection.adequate_ratio
    if len(by_run) < 2 or is_adequate or any(t.is_window for t in fit.segments) or context.is_out_of_time:
        return None
    shared = [p for p in fit.free.paths if "@" not in p]
    fits: dict[int, Fit] = {}
    for run, segments in by_run.items():
        apart = _fit_at_noise(context, fit.model, shared, segments)
        if apart is None:
            return None
        fits[run] = apart
    chosen = _best_models(context, fits)
    validation = validate_each(context, [(fits[run].model, s) for run, s in chosen])
    return RunDifference(validation, _single_parameter(context, fit, fits, chosen))


def _fit_at_noise(context: Context, model: Model, paths: Sequence[str], segments: Sequence[FitSegment]) -> Fit | None:
    """Fit paths of a model to segments; None where the error stays above noise, or the vehicle diverges.

    The segments were prepared with a model of other numbers: their initial states are renewed with each fit.
    """
    quiet, limit = context.in_background(context.jobs), context.settings.selection.adequate_ratio
    try:
        for _ in range(1 + RENEWALS):
            fit = fit_output_error(quiet, model, paths, segments=segments, tolerance=FIT_TOLERANCE)
            if fit.error_to_noise <= limit:
                return fit
            model, segments = fit.model, reprepare_segments(quiet, fit.model, fit.segments)
    except SimulationError:
        return None
    return None


def _best_models(context: Context, fits: Mapping[int, Fit]) -> list[tuple[int, Segment]]:
    """Return for each validation segment the estimation run of which the model has the least error there."""
    chosen = []
    for segment in context.dataset.selection:
        errors = {run: validate(context, fit.model, [segment]).nrmse for run, fit in fits.items()}
        chosen.append((min(errors, key=lambda run: np.nan_to_num(errors[run], nan=np.inf)), segment))
    return chosen


def _single_parameter(
    context: Context, fit: Fit, fits: Mapping[int, Fit], chosen: Sequence[tuple[int, Segment]]
) -> RunDependence | None:
    """Return the parameter, alone or with others in proportion, which suffices where all others are as on one run.

    The reference is the longest run. Of the groups that differ most, the one with fewest parameters is taken.
    """
    p_of = {p: _p_of_difference(p, fits) for p in fit.free.paths if "@" not in p}
    level = context.settings.discrepancy.condition_level / len(p_of)
    groups = [ratios for _, ratios in parameter_groups(fit) if all(p_of[p] < level for p in ratios)]
    groups.sort(key=lambda ratios: float(np.mean([np.log(p_of[p] + 1e-300) for p in ratios])))
    reference = max(fits, key=lambda run: fits[run].normal.samples)
    for ratios in sorted(groups[:COMPARED_GROUPS], key=len):
        alone: dict[int, Fit] = {reference: fits[reference]}
        for run, apart in fits.items():
            refit = None
            if run != reference:
                refit = _fit_at_noise(context, fits[reference].model, list(ratios), apart.segments)
                if refit is None:
                    break
                alone[run] = refit
        if len(alone) == len(fits):
            path = next(iter(ratios))
            family_wise = min(len(p_of) * max(p_of[p] for p in ratios), 1.0)  # all of the group have to differ
            validation = validate_each(context, [(alone[run].model, s) for run, s in chosen])
            return RunDependence(path, ratios, _estimates(context, path, alone, chosen), family_wise, validation)
    return None


def _p_of_difference(path: str, fits: Mapping[int, Fit]) -> float:
    """Probability of the differences between the estimates of the runs where the parameter is the same on all."""
    index = [f.free.paths.index(path) for f in fits.values()]
    rows = [(f.x[i], f.sd[i], f.degrees_of_freedom[i]) for f, i in zip(fits.values(), index, strict=True)]
    values, sd, freedom = (np.array(column) for column in zip(*rows, strict=True))
    return homogeneity(values, sd / interval_factor(freedom), freedom)


def _estimates(
    context: Context, path: str, fits: Mapping[int, Fit], chosen: Sequence[tuple[int, Segment]]
) -> tuple[RunEstimate, ...]:
    """Value of a parameter on every run; on a validation run that of the model which holds there."""
    on_run = {run: run for run in fits} | {s.run_index: run for run, s in chosen}
    estimates = []
    for run, source in on_run.items():
        segments = [s for s in (*context.dataset.estimation, *context.dataset.selection) if s.run_index == run]
        fit, speed = fits[source], float(np.mean([s.mean_speed for s in segments]))
        i = fit.free.paths.index(path)
        estimates.append(RunEstimate(run, segments[0].file, segments[0].role, speed, float(fit.x[i]), float(fit.sd[i])))
    return tuple(estimates)
