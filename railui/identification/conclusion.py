"""Conclusion of the loop: what the selected effects leave, the last step of the estimation, and the verdict."""

from __future__ import annotations

from typing import NamedTuple

from railui.identification.base_model import BaseModel
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.held_parameters import with_spread_of_held_parameters
from railui.identification.estimation.leave_one_out import LeftOutRun, leave_one_run_out
from railui.identification.estimation.noise_floor import NoiseFloor, estimate_noise_floor
from railui.identification.estimation.parameter_samples import with_parameter_samples
from railui.identification.estimation.unbiased import with_shift_as_spread, with_unbiased_estimates
from railui.identification.estimation.validation import Validation, validate
from railui.identification.remainder import describe_remainder
from railui.identification.residual.noise_evidence import (
    ResidualEvidence,
    examine_residual,
    examine_residual_of_each,
)
from railui.identification.residual.sensor_noise_bound import with_noise_within_residual
from railui.identification.residual.track_noise import with_level_of_residual, with_track_noise
from railui.identification.result import IndependentTest, LoopResult, run_independent_test, validate_final
from railui.identification.structure.candidate_scores import NO_SCORE_TEST
from railui.identification.structure.freed_groups import freed_members_lower_error
from railui.identification.structure.gain_forecast import PredictedGains, predict_validation_gain
from railui.identification.structure.score_test import ScoreTestResult
from railui.identification.structure.stepwise import Selection
from railui.identification.unmodelled.condition_dependence import (
    ConditionDependence,
    conditions_explain,
    dependence_on_conditions,
    selection_by_condition,
)
from railui.identification.unmodelled.discrepancy import Discrepancy
from railui.identification.unmodelled.run_dependence import prepare_validation
from railui.identification.unmodelled.search import find_discrepancy, is_small_effect, may_be_track_noise
from railui.identification.unmodelled.sensitive_motion import SensitiveMotion, find_sensitive_motion
from railui.identification.verdict import Explained, Remainder, Verdict, decide_verdict, explained_share
from railui.parallel import run_both


class _Examination(NamedTuple):
    """Residual of the selected effects: its evidence, a discrepancy, and whether the error is that of noise.

    context: without a time budget, and with the track noise that the residual has, where has_track_noise.
    is_out_of_time: whether the budget ended before the search for effects and discrepancies did.
    """

    context: Context
    floor: NoiseFloor
    evidence: ResidualEvidence
    discrepancy: Discrepancy | None
    is_adequate: bool
    is_noise: bool
    has_track_noise: bool
    is_out_of_time: bool


def conclude(context: Context, base: BaseModel, selection: Selection) -> LoopResult:
    """Examine what the selected effects leave, validate on the whole runs, test, and give the verdict."""
    conditions = None if context.is_out_of_time else dependence_on_conditions(context, selection.fit)
    deciding = conditions if conditions_explain(context, conditions) else None
    if deciding is not None:
        selection = selection_by_condition(context, base.fit, selection, deciding)
    context = with_noise_within_residual(context, selection.validation)
    validation_fit = prepare_validation(context, selection.fit)
    if deciding is not None:
        examination = _examine_by_condition(context, selection, deciding)
    else:
        examination = _examine(context, base, selection, validation_fit)
    context, is_cut = examination.context, examination.is_out_of_time
    scores = selection.final_score_test
    final, (predicted_gains, left_out) = run_both(
        lambda: _validated_final_fit(context, base, selection, examination),
        lambda: ({}, []) if is_cut else _first_order_forecasts(context, selection.fit, validation_fit, scores),
        context.jobs,
    )
    judgement = _judge(base, selection, examination, final, deciding)
    is_unexplained = judgement.verdict in (Verdict.OUTSIDE, Verdict.PARTIAL) and not is_cut
    return LoopResult(
        context,
        before=final.base_fit,
        after=final.fit,
        validations=final.validations,
        noise_floor=final.floor,
        steps=selection.steps,
        score_test=scores,
        verdict=judgement.verdict,
        explained=judgement.explained,
        remainder=judgement.remainder,
        test=judgement.test,
        discrepancy=examination.discrepancy,
        windowed=base.windowed,
        is_failed_fit=base.is_failed,
        has_track_noise=examination.has_track_noise,
        is_out_of_time=is_cut,
        left_out=tuple(left_out),
        predicted_gains=predicted_gains,
        freed=selection.freed,
        conditions=conditions,
        floor_of_conditions=None if deciding is None else examination.floor,
        sensitive_motion=_sensitive_motion(context, selection) if is_unexplained else None,
    )


class _Judgement(NamedTuple):
    """Verdict, with the explained share of the error, the remainder and the independent test on which it rests."""

    verdict: Verdict
    explained: Explained | None
    remainder: Remainder
    test: IndependentTest | None


def _judge(
    base: BaseModel,
    selection: Selection,
    examination: _Examination,
    final: _Final,
    deciding: ConditionDependence | None,
) -> _Judgement:
    """Give the verdict on the final model, or on models apart for every condition where these decide."""
    context, discrepancy = examination.context, examination.discrepancy
    errors, noise, scores = final.validations, final.floor, selection.final_score_test
    if deciding is not None:  # the score test is of the residual with common parameters
        errors, noise = {"before": base.validation, "after": deciding.separate}, examination.floor
        scores = NO_SCORE_TEST
    explained = explained_share(errors["before"], errors["after"], noise)
    remainder = describe_remainder(context, errors, noise, examination.evidence, scores, discrepancy)
    by_run = None if deciding is None else deciding.by_run
    test = run_independent_test(context, final.base_fit, final.fit, discrepancy, by_run)
    verdict = decide_verdict(
        context.settings.verdict,
        has_effects=selection.has_effects if deciding is None else selection.fit is not base.fit,
        explained=explained,
        remainder=remainder,
        is_adequate=examination.is_adequate,
        is_noise=examination.is_noise,
        has_discrepancy=discrepancy is not None,
        is_shared=examination.evidence.is_shared,
        has_freed_members=freed_members_lower_error(context, selection.freed, selection.validation),
        is_out_of_time=examination.is_out_of_time,
        diverges=bool(errors["after"].diverged),
        is_contradicted=test is not None and test.is_contradicted,
        exceeds_noise=not errors["after"].nrmse <= context.settings.verdict.max_noise_ratio * noise.nrmse,
    )
    context.progress.message(f"verdict {verdict}: NRMSE {errors['after'].nrmse:.4f}, noise floor {noise.nrmse:.4f}")
    return _Judgement(verdict, explained, remainder, test)


def _sensitive_motion(context: Context, selection: Selection) -> SensitiveMotion | None:
    """Find a law with a sensitive motion where the selected model does not follow the runs."""
    return find_sensitive_motion(context, selection.fit, selection.validation)


class _Final(NamedTuple):
    """The final fit, the one without effects, their validations on the whole runs, and the noise floor there."""

    fit: Fit
    base_fit: Fit
    validations: dict[str, Validation]
    floor: NoiseFloor


def _validated_final_fit(context: Context, base: BaseModel, selection: Selection, examination: _Examination) -> _Final:
    """Take the last step of the estimation, and validate the model on the whole runs."""
    discrepancy = examination.discrepancy
    is_cut = examination.is_out_of_time
    fit = _final_fit(context, base, selection, discrepancy, examination.floor, is_cut=is_cut)
    base_fit = fit if selection.fit is base.fit and discrepancy is None else base.fit
    validations, floor = run_both(
        lambda: final_validations(context, base_fit, fit, discrepancy),
        lambda: estimate_noise_floor(context, fit.model, context.dataset.validation),
        context.jobs,
    )
    return _Final(fit, base_fit, validations, floor)


def _first_order_forecasts(
    context: Context, fit: Fit, validation_fit: Fit | None, scores: ScoreTestResult
) -> tuple[PredictedGains, list[LeftOutRun]]:
    """Predict the gains of effects on the validation runs, and the errors of a model estimated without each run."""
    gains = predict_validation_gain(context, validation_fit, scores)
    return gains, leave_one_run_out(context, fit, validation_fit)


def final_validations(
    context: Context, before: Fit, after: Fit, discrepancy: Discrepancy | None
) -> dict[str, Validation]:
    """Validate the nominal model, and those without and with effects, on the whole validation runs."""
    runs = context.dataset.validation
    calibrated = validate(context, before.model, runs)
    is_same = after is before and discrepancy is None
    return {
        "declared": validate(context, context.nominal, runs),
        "before": calibrated,
        "after": calibrated if is_same else validate_final(context, after, discrepancy, runs),
    }


def _examine(context: Context, base: BaseModel, selection: Selection, validation_fit: Fit | None) -> _Examination:
    """Compare the error with noise, and look for a discrepancy, on the runs that select effects."""
    settings = context.settings.selection
    floor, evidence = run_both(
        lambda: estimate_noise_floor(context, selection.fit.model, context.dataset.selection),
        lambda: examine_residual(context, selection.fit.model),
        context.jobs,
    )
    context.progress.event(floor)
    start = base.windowed if base.windowed is not None and selection.fit is base.fit else selection.fit
    discrepancy = None
    if not freed_members_lower_error(context, selection.freed, selection.validation, floor):
        discrepancy = find_discrepancy(context, start, validation_fit, selection, floor, evidence=evidence)
    if discrepancy is not None and base.is_failed:
        discrepancy = discrepancy.without_calibration()
    is_out_of_time = context.is_out_of_time
    with_noise = None
    # the residual of a failed calibration has the errors of all parameters
    if not base.is_failed and may_be_track_noise(context, discrepancy, selection, floor, evidence):
        with_noise = with_track_noise(context, selection.fit.model, selection.validation, floor)
        if with_noise is not None:
            context, discrepancy = with_noise, None
            floor = estimate_noise_floor(context, selection.fit.model, context.dataset.selection)
            evidence = examine_residual(context, selection.fit.model)
            context.progress.message(f"track noise of {1e3 * context.noise['yw']:.2g} mm (yw) explains the residual")
    is_small = discrepancy is not None and is_small_effect(context, discrepancy, selection)
    discrepancy = None if is_small else discrepancy
    ratio = selection.validation.nrmse / floor.nrmse
    is_noise = ratio <= settings.unexplained_ratio or evidence.is_noise or is_small
    is_adequate, has_track_noise = ratio <= settings.adequate_ratio, with_noise is not None
    context = context.without_deadline()
    return _Examination(context, floor, evidence, discrepancy, is_adequate, is_noise, has_track_noise, is_out_of_time)


def _examine_by_condition(context: Context, selection: Selection, dependence: ConditionDependence) -> _Examination:
    """Compare the error of parameters apart for every condition with noise; no discrepancy is looked for."""
    settings = context.settings.selection
    floor, evidence = run_both(
        lambda: estimate_noise_floor(context, selection.fit.model, context.dataset.selection),
        lambda: examine_residual_of_each(context, dependence.models),
        context.jobs,
    )
    context.progress.event(floor)
    ratio = dependence.separate_nrmse / floor.nrmse
    is_noise = ratio <= settings.unexplained_ratio or evidence.is_noise
    is_adequate, is_out_of_time = ratio <= settings.adequate_ratio, context.is_out_of_time
    context = context.without_deadline()
    return _Examination(context, floor, evidence, None, is_adequate, is_noise, False, is_out_of_time)


def _final_fit(
    context: Context,
    base: BaseModel,
    selection: Selection,
    discrepancy: Discrepancy | None,
    floor: NoiseFloor,
    *,
    is_cut: bool,
) -> Fit:
    """Return the fit of a discrepancy that lowers the error without effects, or that of the last step.

    floor: noise floor on the runs that select effects.
    is_cut: the time budget is spent, and the last step of the estimation is left out.
    """
    if discrepancy is not None and discrepancy.lowers_error and not selection.has_effects:
        return discrepancy.fit
    if (discrepancy is not None and discrepancy.fit is selection.fit) or base.is_failed or is_cut:
        return selection.fit
    if discrepancy is None:
        context = with_level_of_residual(context, selection.fit.model, selection.validation, floor)
    return final_estimates(context, selection.fit, selection.validation)


def with_final_estimates(context: Context, base: BaseModel) -> BaseModel:
    """Take the last step of the estimation as a loop does that adds no effect."""
    if base.is_failed:
        return base
    floor = estimate_noise_floor(context, base.fit.model, context.dataset.selection)
    context = with_level_of_residual(context, base.fit.model, base.validation, floor)
    return base._replace(fit=final_estimates(context, base.fit, base.validation))


def final_estimates(context: Context, fit: Fit, validation: Validation) -> Fit:
    """Take the last step of the estimation, unless it raises the misfit of the validation runs by too much."""
    last = with_spread_of_held_parameters(context, with_unbiased_estimates(context, fit))
    if last.shift.size:
        limit = (1.0 + context.settings.calibration.bias_misfit_share) ** 0.5 * validation.nrmse
        is_as_good = validate(context, last.model, context.dataset.selection).nrmse <= limit
        last = last if is_as_good else with_shift_as_spread(fit, last)
    return with_parameter_samples(context, last)
