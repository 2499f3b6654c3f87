"""Variation of a parameter within the runs: along the track, of a driven rig with time."""

from __future__ import annotations

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.prediction import SimulationError
from railui.identification.structure.drift import Drift, find_drifts, refine_drift, validate_drift
from railui.identification.unmodelled.discrepancy import Discrepancy, DiscrepancyCurve, location_of
from railui.identification.unmodelled.location_evidence import LocationEvidence, evidence_of_blocks, expected_misfit


def is_conclusive(context: Context, variation: Discrepancy | None) -> bool:
    """True if a variation explains so much that no gain on the validation runs is required."""
    least = context.campaign.min_gain
    return variation is not None and variation.drift is not None and variation.explained_share >= least


def find_variation(context: Context, fit: Fit) -> Discrepancy | None:
    """Find the parameter whose variation along the track, of a driven rig with time, explains most.

    None if chance explains as much.
    """
    try:
        drift = _refined_drift(context, fit)
        if drift is None:
            return None
        validation = validate_drift(context, fit.model, drift, context.dataset.selection)
    except SimulationError:
        return None
    is_on_track = fit.model.design.is_on_track
    course = "along the track" if is_on_track else "with time"
    context.progress.message(
        f"  {drift.path} varying {course}: explains {drift.share:.2f}, NRMSE {validation.nrmse:.4f}"
    )
    at, wheelset = location_of(drift.path, drift.ratios, fit.model)
    unit = fit.model.design.unit(drift.path)
    against, course_unit = ("s", "m") if is_on_track else ("t", "s")
    curve = DiscrepancyCurve(against, drift.abscissa, drift.values, drift.sd, course_unit, unit)
    return Discrepancy(at, wheelset, curve, drift.share, fit, validation, drift, evidence=_drift_evidence(fit, drift))


def _refined_drift(context: Context, fit: Fit) -> Drift | None:
    """Return the first drift, the best by the linear estimate first, that explains enough after refinement as well."""
    least = context.settings.discrepancy.min_drift_share
    promising = (drift for drift in find_drifts(context, fit) if drift.share >= least)
    refined = (refine_drift(context, fit, drift) for drift in promising)
    return next((drift for drift in refined if drift.share >= least), None)


def _drift_evidence(fit: Fit, drift: Drift) -> LocationEvidence:
    """Share of the residual beyond noise that a drift explains beyond chance."""
    before = fit.normal.gram[:, :, 0, 0].sum(axis=1)
    by_chance = drift.chance_share * fit.normal.rss / len(before)
    return evidence_of_blocks(before, drift.squares + by_chance, expected_misfit(fit))
