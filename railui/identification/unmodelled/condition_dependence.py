"""Dependence on conditions: the parameters of a model, estimated apart on the runs of every stated condition.

A campaign may state a condition of its runs, such as the current of a magneto-rheological damper or a temperature. The
model with its effects is fitted to all runs together and to those of each condition; a parameter depends on the
condition where its estimates differ by more than their standard deviations allow.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from railui.arrays import FloatArray
from railui.identification.context import Context, OutOfTimeError
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.covariance import interval_factor
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import FitSegment, prepare_segments
from railui.identification.estimation.validation import validate, validate_each
from railui.identification.prediction import SimulationError
from railui.identification.structure.stepwise import StepwiseSelection
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
    model : Model
        The model of all runs together.
    parameters : tuple of ConditionParameter
        Those that depend on the condition first, the largest reduction of the error first.
    common_nrmse, separate_nrmse : float
        Error on the validation runs with common and with separate parameters.
    """

    name: str
    conditions: tuple[str, ...]
    model: Model
    parameters: tuple[ConditionParameter, ...]
    common_nrmse: float
    separate_nrmse: float


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
        if selected.effects == fit.model.effects:
            return dependence
        again = comparison.compare(selected)
    except OutOfTimeError:
        return dependence
    return min(again, dependence, key=lambda d: d.separate_nrmse)


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
        common = fit_output_error(context, model, paths, segments=segments).model
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
            alone = self._error(self._fits(common, [path], segments))
            rows.append(ConditionParameter(path, values, sd, p, p < level, alone))
        rows.sort(key=lambda row: (not row.depends, row.alone_nrmse))
        name = ", ".join(context.campaign.runs[0].conditions)
        error = validate(context, common, self.validation).nrmse
        return ConditionDependence(name, tuple(self.conditions), common, tuple(rows), error, self._error(separate))

    def _fits(self, model: Model, paths: Sequence[str], segments: Sequence[FitSegment]) -> dict[str, Fit]:
        """Fit paths of a model to the estimation runs of each condition."""
        of = {c: [t for t in segments if self.labels[t.segment.run_index] == c] for c in self.conditions}
        fits = {c: fit_output_error(self.context, model, paths, segments=part) for c, part in of.items()}
        self.context.check_time()  # a fit that the time ended is no estimate
        return fits

    def _error(self, fits: Mapping[str, Fit]) -> float:
        """Error on the validation runs, each with the model of its condition."""
        models = [(fits[self.labels[s.run_index]].model, s) for s in self.validation]
        return validate_each(self.context, models).nrmse

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
