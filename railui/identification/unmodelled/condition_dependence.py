"""Dependence on conditions: the parameters of a model, estimated apart on the runs of every stated condition.

A campaign may state a condition of its runs, such as the current of a magneto-rheological damper or a temperature. The
model with its effects is fitted to all runs together and to those of each condition; a parameter depends on the
condition where its estimates differ by more than their standard deviations allow.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import special

from railui.arrays import FloatArray
from railui.campaign.segment import Segment
from railui.identification.context import Context, OutOfTimeError
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.covariance import interval_factor
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.noise_floor import estimate_noise_floor
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import FitSegment, prepare_segments
from railui.identification.estimation.validation import (
    Validation,
    is_significant_gain,
    validate,
    validate_each,
)
from railui.identification.prediction import SimulationError
from railui.identification.structure.candidate_scores import run_score_test
from railui.identification.structure.freed_groups import FreedGroups
from railui.identification.structure.stage import SelectionStep
from railui.identification.structure.stepwise import Selection, StepwiseSelection
from railui.vehicle.model import Model


@dataclass(frozen=True)
class ConditionParameter:
    """Estimates of a parameter under every condition.

    Attributes
    ----------
    path : str
    values, sd : tuple of float
        Estimate and standard deviation under each condition, SI.
    p : float
        Probability of such differences where the parameter is the same under all conditions.
    depends : bool
    alone_nrmse : float
        Error on the validation runs where this parameter alone differs between conditions.
    """

    path: str
    values: tuple[float, ...]
    sd: tuple[float, ...]
    p: float
    depends: bool
    alone_nrmse: float


@dataclass(frozen=True)
class ConditionDependence:
    """Parameters of a model under the conditions of a campaign.

    Attributes
    ----------
    name : str
        Name of the condition; several are joined by commas.
    conditions : tuple of str
        Their values in the order of the campaign.
    fit : Fit
        The model of all runs together.
    parameters : tuple of ConditionParameter
        Those that depend on the condition first, the largest reduction of the error first.
    common, separate : Validation
        On the validation runs, with common and with separate parameters.
    models : tuple of (Model, Segment)
        Each of these validation runs with the model of its condition.
    by_run : dict
        Model of the condition of each run, by its index in the campaign; runs under other conditions have none.
    """

    name: str
    conditions: tuple[str, ...]
    fit: Fit
    parameters: tuple[ConditionParameter, ...]
    common: Validation
    separate: Validation
    models: tuple[tuple[Model, Segment], ...]
    by_run: Mapping[int, Model] = field(repr=False)

    @property
    def model(self) -> Model:
        """The model of all runs together."""
        return self.fit.model

    @property
    def common_nrmse(self) -> float:
        """Error on the validation runs with common parameters."""
        return self.common.nrmse

    @property
    def separate_nrmse(self) -> float:
        """Error on the validation runs with separate parameters."""
        return self.separate.nrmse


def estimate_condition_dependence(context: Context, fit: Fit) -> ConditionDependence | None:
    """Estimate all parameters of a fit under each condition; None if the runs state fewer than two conditions.

    Where the conditions matter, no effect can be selected on all runs together, whose residual is their difference.
    The effects are then selected under the condition with the largest relative residual. Conditions without an
    estimation run are left out. ValueError if a simulation diverges, OutOfTimeError where the time budget ends before
    the estimates are complete.
    """
    labels = [", ".join(entry.conditions.values()) for entry in context.campaign.runs]
    here = list(dict.fromkeys(labels[s.run_index] for s in context.dataset.estimation))
    if len(here) < 2 or "" in here:
        return None
    comparison = _Comparison(context, labels, here)
    if not comparison.validation:
        context.progress.message("no dependence on conditions estimated: no validation run has one of theirs")
        return None
    dependence = comparison.compare(fit.model)
    if dependence.separate_nrmse > (1.0 - context.campaign.min_relative_gain) * dependence.common_nrmse:
        return dependence
    try:
        selected = comparison.select_effects(fit.model)
        if _placed(selected) == _placed(fit.model):
            return dependence
        again = comparison.compare(selected)
    except OutOfTimeError:
        return dependence
    return _with_needed_effects(context, dependence, again)


def _with_needed_effects(context: Context, one: ConditionDependence, other: ConditionDependence) -> ConditionDependence:
    """Return that with fewer effects, unless those of the other lower the error with separate parameters enough."""
    fewer, more = sorted((one, other), key=lambda d: (len(d.model.effects), d.separate_nrmse))
    limit = (1.0 - context.campaign.min_relative_gain) * fewer.separate_nrmse
    return more if more.separate_nrmse < limit else fewer


def dependence_on_conditions(context: Context, fit: Fit) -> ConditionDependence | None:
    """Estimate the dependence on stated conditions.

    None where there are none, a simulation diverges, or the time budget is spent.
    """
    try:
        dependence = estimate_condition_dependence(context, fit)
    except SimulationError as error:
        context.progress.message(f"no dependence on conditions estimated: {error}")
        return None
    except OutOfTimeError:
        context.progress.message("no dependence on conditions estimated: the time budget is spent")
        return None
    if dependence is not None:
        context.progress.message(
            f"parameters apart for {', '.join(dependence.conditions)}: "
            f"NRMSE {dependence.common_nrmse:.4f} -> {dependence.separate_nrmse:.4f}"
        )
    return dependence


class _Comparison:
    """Fits of one model to the runs of each condition, and to all of them."""

    def __init__(self, context: Context, labels: Sequence[str], conditions: Sequence[str]) -> None:
        self.context = context
        self.labels = labels
        self.conditions = conditions
        self.validation = [s for s in context.dataset.selection if labels[s.run_index] in conditions]

    def compare(self, model: Model) -> ConditionDependence:
        """Estimate the parameters of a model under each condition, and each parameter alone."""
        context = self.context
        paths = [*context.campaign.estimated_parameters, *model.effect_paths()]
        segments = prepare_segments(context, model, context.dataset.estimation)
        fit = fit_output_error(context, model, paths, segments=segments)
        common = fit.model
        separate = self._fits(common, paths, segments)
        level = context.settings.discrepancy.condition_level / len(paths)
        rows = []
        for path in paths:
            index = [f.free.paths.index(path) for f in separate.values()]
            estimates = [
                (f.x[i], f.sd[i], f.degrees_of_freedom[i]) for f, i in zip(separate.values(), index, strict=True)
            ]
            values, sd, freedom = (tuple(map(float, column)) for column in zip(*estimates, strict=True))
            p = homogeneity(np.array(values), np.array(sd) / interval_factor(np.array(freedom)), np.array(freedom))
            alone = self._validate(self._fits(common, [path], segments)).nrmse
            rows.append(ConditionParameter(path, values, sd, p, p < level, alone))
        rows.sort(key=lambda row: (not row.depends, row.alone_nrmse))
        name = ", ".join(context.campaign.runs[0].conditions)
        together, apart = validate(context, common, self.validation), self._validate(separate)
        models = tuple(self._models(separate))
        by_run = {run: separate[label].model for run, label in enumerate(self.labels) if label in separate}
        return ConditionDependence(name, tuple(self.conditions), fit, tuple(rows), together, apart, models, by_run)

    def _fits(self, model: Model, paths: Sequence[str], segments: Sequence[FitSegment]) -> dict[str, Fit]:
        """Fit paths of a model to the estimation runs of each condition."""
        of = {c: [t for t in segments if self.labels[t.segment.run_index] == c] for c in self.conditions}
        fits = {c: fit_output_error(self.context, model, paths, segments=part) for c, part in of.items()}
        self.context.check_time()  # a fit that the time ended is no estimate
        return fits

    def _models(self, fits: Mapping[str, Fit]) -> list[tuple[Model, Segment]]:
        """Each validation run with the model of its condition."""
        return [(fits[self.labels[s.run_index]].model, s) for s in self.validation]

    def _validate(self, fits: Mapping[str, Fit]) -> Validation:
        """Validate the models of the conditions, each on its runs."""
        return validate_each(self.context, self._models(fits))

    def select_effects(self, model: Model) -> Model:
        """Select effects on the runs of the condition with the largest relative residual, stepwise."""
        segments = prepare_segments(self.context, model, self.context.dataset.estimation)
        fits = self._fits(model, self.context.campaign.estimated_parameters, segments)
        reference = max(fits, key=lambda c: fits[c].normal.misfit_per_sample)
        dataset = self.context.dataset
        kept = tuple(s for s in dataset.segments if self.labels[s.run_index] == reference)
        roles = {s.role for s in kept}
        if not {"adjust", "validate"} <= roles:
            return model
        self.context.progress.message(f"the conditions differ: effects selected at {reference}")
        context = replace(self.context.in_background(self.context.jobs), dataset=replace(dataset, segments=kept))
        before = calibrate(context)
        validation = validate(context, before.model, context.dataset.selection)
        return StepwiseSelection(context).select_effects(before, validation).fit.model


def conditions_explain(context: Context, dependence: ConditionDependence | None) -> bool:
    """True where parameters apart for every condition remove the larger part of the error beyond noise.

    Every validation run must have a condition of an estimation run, and a parameter must depend on the condition.
    """
    if dependence is None or not any(row.depends for row in dependence.parameters):
        return False
    if len(dependence.models) < len(context.dataset.selection):
        return False
    common, separate = dependence.common, dependence.separate
    if not is_significant_gain(context, common, separate):
        return False
    draws = context.settings.validation.preliminary_floor_draws
    floor = estimate_noise_floor(context, dependence.model, context.dataset.selection, draws).nrmse
    level = floor if np.isfinite(floor) else 0.0
    removed, beyond = common.nrmse**2 - separate.nrmse**2, common.nrmse**2 - level**2
    return removed >= context.settings.discrepancy.min_condition_share * beyond


def selection_by_condition(
    context: Context, base: Fit, selection: Selection, dependence: ConditionDependence
) -> Selection:
    """Return the selection with the effects of the model whose parameters depend on the condition.

    base: the model without effects. A step whose effect that model does not have has added none.
    """
    effects = _placed(dependence.model)
    if effects == _placed(selection.fit.model):
        return replace(selection, freed=FreedGroups())
    fit = base if effects == _placed(base.model) else dependence.fit
    steps = tuple(s if _has_added_one_of(s, effects) else replace(s, added=None) for s in selection.steps)
    return Selection(fit, dependence.common, steps, run_score_test(context, fit), FreedGroups())


def _placed(model: Model) -> list[tuple[str, str, int | None]]:
    """Kind and location of every effect of a model."""
    return [(e.kind, e.at, e.wheelset) for e in model.effects]


def _has_added_one_of(step: SelectionStep, effects: Collection[tuple[str, str, int | None]]) -> bool:
    candidate = step.added.candidate if step.added else None
    return candidate is not None and (candidate.kind, candidate.at, candidate.wheelset) in effects


def homogeneity(values: FloatArray, sd: FloatArray, freedom: FloatArray) -> float:
    """Probability that estimates [n] of one number differ as much by chance, from Welch's test.

    Its statistic, the weighted squares about the weighted mean, follows an F distribution of which the second degrees
    of freedom fall with those of the standard deviations. Cochran's Q, which takes these as known, would find the few
    blocks of a short run different far too often.

    Parameters
    ----------
    values, sd
        Estimates [n] and their standard deviations [n]; 1 is returned where one of these is zero.
    freedom
        Degrees of freedom [n] of the standard deviations.

    References
    ----------
    Welch, Biometrika 38 (1951) 330.

    Examples
    --------
    >>> round(homogeneity(np.array([1.0, 1.1]), np.array([0.1, 0.1]), np.array([1e9, 1e9])), 2)
    0.48
    >>> round(homogeneity(np.array([0.0, 3.0]), np.array([1.0, 1.0]), np.array([4.0, 4.0])), 3)  # Welch's t test
    0.067
    """
    n = len(values)
    if not np.all(sd > 0.0):
        return 1.0
    weights = (sd.min() / sd) ** 2
    share = weights / np.sum(weights)
    spread = np.sum(weights * (values - np.sum(share * values)) ** 2) / sd.min() ** 2 / (n - 1)
    loss = np.sum((1.0 - share) ** 2 / freedom)
    statistic = spread / (1.0 + 2.0 * (n - 2) / (n**2 - 1) * loss)
    return float(special.fdtrc(n - 1, (n**2 - 1) / (3.0 * loss), statistic))
