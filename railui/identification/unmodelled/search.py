"""Search for a discrepancy that no effect of the library explains, within the runs or between them."""

from __future__ import annotations

from dataclasses import replace

from railui.campaign.comparison import compared_channels
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.noise_floor import NoiseFloor
from railui.identification.estimation.validation import is_significant_gain
from railui.identification.residual.noise_evidence import ResidualEvidence, examine_residual
from railui.identification.structure.candidate_scores import has_structure, run_score_test
from railui.identification.structure.stepwise import Selection
from railui.identification.unmodelled.discrepancy import Discrepancy
from railui.identification.unmodelled.locate import locate_discrepancy
from railui.identification.unmodelled.location_evidence import CONTACT_LOCATIONS, NO_EVIDENCE
from railui.identification.unmodelled.run_difference import (
    difference_between_estimation_runs,
    find_run_dependence,
    unexplained_difference,
)
from railui.identification.unmodelled.variation import find_variation, is_conclusive


def find_discrepancy(
    context: Context,
    fit: Fit,
    validation_fit: Fit | None,
    selection: Selection,
    floor: NoiseFloor,
    evidence: ResidualEvidence,
) -> Discrepancy | None:
    """Find what acts in addition to the selected effects and is not in the library; None where noise explains the rest.

    Parameters
    ----------
    fit
        The model from which the search starts, with the selected effects.
    validation_fit
        That model prepared on the validation runs; None where it hunts there.
    floor
        Error that noise leaves on the runs that selected the effects.
    evidence
        Coherence of the residual.
    """
    error_to_noise = selection.validation.nrmse / floor.nrmse
    if error_to_noise <= context.settings.selection.adequate_ratio or context.is_out_of_time:
        return None

    def between_runs() -> Discrepancy | None:
        return find_run_dependence(context, fit, validation_fit, selection.validation, floor.nrmse)

    def within_runs() -> Discrepancy | None:
        return find_acting_discrepancy(context, fit, selection, error_to_noise, evidence)

    if not is_at_noise_floor(context, fit, error_to_noise):
        difference = None
        if error_to_noise > context.settings.selection.unexplained_ratio:
            difference = difference_between_estimation_runs(context, fit, selection.validation, floor.nrmse)
        return difference or within_runs() or between_runs()
    difference = between_runs()
    if difference is not None and difference.run_dependence is not None:
        return difference
    discrepancy = within_runs()
    if discrepancy is None or _is_established(context, discrepancy):
        return discrepancy or difference
    # at their noise floor the estimation runs locate nothing: the validation runs show the difference
    return difference or unexplained_difference(context, fit, validation_fit, selection.validation)


def find_acting_discrepancy(
    context: Context, fit: Fit, selection: Selection, error_to_noise: float, evidence: ResidualEvidence
) -> Discrepancy | None:
    """Find a discrepancy that acts on the estimation runs."""
    is_structured = has_structure(context.settings.score_test, selection.final_score_test)
    is_unexplained = not error_to_noise <= context.settings.selection.unexplained_ratio  # True for NaN
    variation = find_variation(context, fit)
    # the values along a track need not be those of another; on a rig the validation runs must show them as well
    if variation is not None and variation.curve.against == "t":
        variation = variation if is_significant_gain(context, selection.validation, variation.validation) else None
    discrepancy = variation
    if is_unexplained or is_structured or is_conclusive(context, variation):
        discrepancy = locate_discrepancy(context, fit, variation)
    if discrepancy is None:
        return None
    lowers_error = is_significant_gain(context, selection.validation, discrepancy.validation)
    if not lowers_error and _has_single_channel(context):
        discrepancy = replace(discrepancy, evidence=NO_EVIDENCE)
    # without effects a structure counts from the gain that an effect must have; with effects it is their remainder
    is_material = not error_to_noise <= 1.0 / (1.0 - context.campaign.min_relative_gain)
    is_structure = is_structured and (is_unexplained or (is_material and not selection.has_effects))
    # a residual that several channels share is a force, or noise of the track, which `may_be_track_noise` decides
    is_unsolved = is_structure or (is_unexplained and not evidence.is_noise)
    if lowers_error or is_conclusive(context, discrepancy) or is_unsolved:
        return replace(discrepancy, lowers_error=lowers_error)
    return None


def _has_single_channel(context: Context) -> bool:
    """True where forces at any location can explain the residual, so that only a law that transfers locates one."""
    return all(not s.is_rig and len(compared_channels(s)) == 1 for s in context.dataset.estimation)


def _is_force_on_vehicle(context: Context, discrepancy: Discrepancy) -> bool:
    """True for a located force that noise of the track columns, which acts at the contact, cannot imitate."""
    settings, evidence = context.settings.verdict, discrepancy.evidence
    locations = {at for at, _, _ in discrepancy.locations(settings)}
    if not locations or not locations.isdisjoint(CONTACT_LOCATIONS):
        return False
    excess = evidence.share - discrepancy.contact_share
    return excess > max(settings.min_location_excess, settings.location_standard_errors * evidence.standard_error)


def _is_established(context: Context, discrepancy: Discrepancy) -> bool:
    """True for a discrepancy that lowers the error, differs from run to run, or follows a law."""
    return discrepancy.lowers_error or discrepancy.run_dependence is not None or is_conclusive(context, discrepancy)


def may_be_track_noise(
    context: Context,
    discrepancy: Discrepancy | None,
    selection: Selection,
    floor: NoiseFloor,
    evidence: ResidualEvidence,
) -> bool:
    """True for a discrepancy that noise of the track columns can imitate: forces at the contact that follow no law.

    Where a law of the library explains much of the residual of the estimation runs, noise does not, unless that law,
    too small to be selected, leaves what noise of the track can be. Without a discrepancy, True for a residual above
    the noise floor that several channels share and that has no structure.
    """
    settings, scores = context.settings.score_test, selection.final_score_test
    if discrepancy is None:
        is_adequate = selection.validation.nrmse <= context.settings.selection.adequate_ratio * floor.nrmse
        return evidence.is_shared and not is_adequate and not has_structure(settings, scores)
    if _is_established(context, discrepancy) or any(s.is_rig for s in context.dataset.selection):
        return False
    if scores.rho2 >= settings.obvious_rho2:
        fit = _best_refit(context, selection)
        if fit is None or run_score_test(context, fit).rho2 > settings.noise_rho2:
            return False
    return not _is_force_on_vehicle(context, discrepancy)


def is_small_effect(context: Context, discrepancy: Discrepancy, selection: Selection) -> bool:
    """True where an effect of the library, too small to be selected, leaves nothing but noise of the residual.

    Noise far above its estimated floor, as coloured noise is, hides the share of the error that the effect explains;
    what acts is in the library all the same.
    """
    if _is_established(context, discrepancy) or context.is_out_of_time:
        return False
    fit = _best_refit(context, selection)
    if fit is None:
        return False
    if not examine_residual(context, fit.model).is_noise:
        return False
    return not has_structure(context.settings.score_test, run_score_test(context, fit))


def _best_refit(context: Context, selection: Selection) -> Fit | None:
    """Return the fit of the effect that explains most of a structured final residual; None where none was fitted."""
    step = next((s for s in selection.steps if s.score_test is selection.final_score_test), None)
    if step is None or not has_structure(context.settings.score_test, step.score_test):
        return None
    return min((r.fit for r in step.refits if r.candidate is not None), key=lambda fit: fit.normal.rss, default=None)


def is_at_noise_floor(context: Context, fit: Fit, error_to_noise: float) -> bool:
    """True where the estimation runs are at their noise floor while the validation runs are not at theirs."""
    share = context.settings.discrepancy.noise_floor_excess_share
    return fit.error_to_noise - 1.0 < share * (error_to_noise - 1.0)
