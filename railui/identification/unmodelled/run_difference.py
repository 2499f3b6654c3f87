"""Differences between the runs that no common model explains, of one parameter or of an unknown cause."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.validation import Validation, is_significant_gain
from railui.identification.prediction import SimulationError
from railui.identification.structure.equivalent_inputs import locate_forces
from railui.identification.unmodelled.discrepancy import Discrepancy, DiscrepancyCurve, location_of
from railui.identification.unmodelled.location_evidence import (
    NO_EVIDENCE,
    LocationEvidence,
    evidence_of_validations,
    rival_locations,
    share_at_contact,
)
from railui.identification.unmodelled.run_by_run import find_run_difference
from railui.identification.unmodelled.run_dependence import RunDependence, detect_run_dependence


def find_run_dependence(
    context: Context, fit: Fit, validation_fit: Fit | None, validation: Validation, floor: float
) -> Discrepancy | None:
    """Find what differs from run to run; None unless separate values of a parameter lower the error significantly.

    It is that parameter where its values explain the difference, else an unexplained difference. No fit uses the
    validation runs: the reported error stays that of the calibrated model.

    Parameters
    ----------
    floor
        NRMSE that noise leaves on the validation runs.
    """
    if validation_fit is None or not np.isfinite(validation.nrmse):
        return None
    try:
        change = detect_run_dependence(context, fit, validation_fit)
    except SimulationError:
        return None
    if change is None:
        return None
    context.progress.message(
        f"  p {change.p:.4f} under the hypothesis that no parameter differs from run to run; "
        f"{change.path} separate for every run: NRMSE {change.validation.nrmse:.4f}"
    )
    if not is_significant_gain(context, validation, change.validation):
        return None
    evidence = evidence_of_validations(validation, change.validation, floor)
    is_adequate = change.validation.nrmse <= context.settings.selection.adequate_ratio * floor
    if not is_adequate and evidence.share < context.settings.run_dependence.min_run_dependence_share:
        return unexplained_difference(context, fit, validation_fit, validation)
    return _of_run_dependence(context, fit, validation, change, evidence)


def difference_between_estimation_runs(
    context: Context, fit: Fit, validation: Validation, floor: float
) -> Discrepancy | None:
    """Find a difference between the estimation runs; None unless models of each are at noise, and on validation runs.

    Parameters
    ----------
    floor
        NRMSE that noise leaves on the validation runs.
    """
    found = find_run_difference(context, fit)
    if found is None or not is_significant_gain(context, validation, found.validation):
        return None
    context.progress.message(f"  models apart for every estimation run: NRMSE {found.validation.nrmse:.4f}")
    evidence = evidence_of_validations(validation, found.validation, floor)
    is_adequate = found.validation.nrmse <= context.settings.selection.adequate_ratio * floor
    if not is_adequate and evidence.share < context.settings.run_dependence.min_run_dependence_share:
        return None
    alone = found.dependence
    if alone is None or not is_significant_gain(context, validation, alone.validation):
        return _unlocated_difference(fit, validation, evidence.share)
    of_parameter = evidence_of_validations(validation, alone.validation, floor)
    return _of_run_dependence(context, fit, validation, alone, of_parameter)


def _of_run_dependence(
    context: Context, fit: Fit, validation: Validation, change: RunDependence, evidence: LocationEvidence
) -> Discrepancy:
    """Return a parameter that differs from run to run as a discrepancy."""
    share = validation.error_reduction(change.validation).share
    at, wheelset = location_of(change.path, change.ratios, fit.model)
    calibrated = fit.model.value(change.path)
    extreme = max((r for r in change.runs if r.role == "validate"), key=lambda r: abs(r.value - calibrated))
    segments = [s for s in context.dataset.selection if s.run_index == extreme.run]
    against, unit_of_course = ("s", "m") if fit.model.design.is_on_track else ("t", "s")
    ends = np.array([segments[0].columns[against][0], segments[-1].columns[against][-1]])
    values, sd, unit = np.full(2, extreme.value), np.full(2, extreme.sd), fit.model.design.unit(change.path)
    curve = DiscrepancyCurve(against, ends, values, sd, unit_of_course, unit)
    return Discrepancy(at, wheelset, curve, share, fit, validation, run_dependence=change, evidence=evidence)


def unexplained_difference(
    context: Context, fit: Fit, validation_fit: Fit | None, validation: Validation
) -> Discrepancy:
    """Return a difference between runs that no parameter explains, located by forces on the validation runs."""
    forces = [] if validation_fit is None else locate_forces(context, validation_fit)
    locating = [f for f in forces if f.can_locate(context.settings.discrepancy)]
    at, wheelset, evidence = "", None, NO_EVIDENCE
    if locating:
        best = locating[0]
        at, wheelset, evidence = best.at, best.wheelset, LocationEvidence(best.share, best.standard_error)
        context.progress.message(
            f"  residual of the validation runs resembles forces at {at} {wheelset or ''}: "
            f"share {best.share:.2f} +/- {best.standard_error:.2f}"
        )
    rivals = rival_locations(context.settings, locating) if locating else ()
    return replace(
        _unlocated_difference(fit, validation, evidence.share),
        at=at,
        wheelset=wheelset,
        evidence=evidence,
        contact_share=share_at_contact(forces),
        rivals=rivals,
    )


def _unlocated_difference(fit: Fit, validation: Validation, share: float) -> Discrepancy:
    """Return a difference between runs that no parameter explains."""
    against, unit = ("s", "m") if fit.model.design.is_on_track else ("t", "s")
    none = np.zeros(0)
    curve = DiscrepancyCurve(against, none, none, none, unit, "N")
    return Discrepancy("", None, curve, share, fit, validation, is_unexplained_difference=True)
