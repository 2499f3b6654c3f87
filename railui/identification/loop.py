"""The loop: calibrate, test the residual for unmodelled effects, add them, calibrate again, validate."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

from railui.campaign.data_checks import check_data
from railui.campaign.dataset import Dataset
from railui.campaign.faults.fault import Diagnosis
from railui.campaign.finding import Finding
from railui.identification.context import Context, create_context
from railui.identification.estimation.calibration import (
    calibrate,
    calibrate_from,
    fit_without_iteration,
    stable_start,
    with_phases,
)
from railui.identification.estimation.failed_fit import has_failed, retry_failed_fit
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.held_parameters import with_spread_of_held_parameters
from railui.identification.estimation.leave_one_out import LeftOutRun, leave_one_run_out
from railui.identification.estimation.multiple_shooting import refit_hunting
from railui.identification.estimation.noise_floor import NoiseFloor, estimate_noise_floor
from railui.identification.estimation.parallel_models import two_parallel_models
from railui.identification.estimation.parameter_samples import with_parameter_samples
from railui.identification.estimation.problem import prepare_segments
from railui.identification.estimation.unbiased import with_shift_as_spread, with_unbiased_estimates
from railui.identification.estimation.validation import Validation, validate
from railui.identification.events import ModelValidated
from railui.identification.remainder import describe_remainder
from railui.identification.residual.noise_evidence import (
    NOT_EXAMINED,
    ResidualEvidence,
    examine_residual,
    examine_residual_of_each,
)
from railui.identification.residual.sensor_noise_bound import with_noise_within_residual
from railui.identification.residual.track_noise import with_level_of_residual, with_track_noise
from railui.identification.residual.withdrawn_gains import contradicted_gains
from railui.identification.result import LoopResult, run_independent_test, validate_final
from railui.identification.structure.candidate_scores import NO_SCORE_TEST
from railui.identification.structure.freed_groups import freed_members_lower_error
from railui.identification.structure.gain_forecast import PredictedGains, predict_validation_gain
from railui.identification.structure.score_test import ScoreTestResult
from railui.identification.structure.stage import SelectionStep
from railui.identification.structure.stepwise import Selection, StepwiseSelection
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
from railui.identification.verdict import Verdict, decide_verdict, explained_share
from railui.parallel import run_both
from railui.progress import SILENT, Progress

METHODS = ("least-squares", "two-parallel-models")


def close_loop(
    dataset: Dataset,
    *,
    without: Collection[str] = (),
    seed: int = 0,
    jobs: int | None = None,
    progress: Progress = SILENT,
    budget: float | None = None,
    diagnosis: Diagnosis | None = None,
) -> LoopResult:
    """Close the loop on a dataset. The validation runs select effects; no parameter is fitted to them.

    Parameters
    ----------
    without
        Kinds of effects that may not be proposed.
    diagnosis
        Faults of the data, where they are known already.
    progress
        Receives messages, and as events `ModelValidated`, the `FitIteration` of the main fits, `ScoreTestProgress`,
        each `ScoreTestResult`, the `ScoreResult` about to be refitted, its `Refit`, and the `NoiseFloor`.
    budget
        Time [s] after which no further step begins, and fits end at their present iteration; the result then depends
        on the speed of the machine.
    """
    started = time.perf_counter()
    context = create_context(dataset, seed=seed, jobs=jobs, progress=progress, excluded=without, budget=budget)
    findings = report_data_checks(context, diagnosis)
    context = with_phases(context)
    nominal = validate(context, context.nominal, dataset.selection)
    progress.event(ModelValidated("declared", nominal))
    progress.message(f"nominal model: NRMSE {nominal.nrmse:.4f} on the validation runs")
    if nominal.nrmse > 1.0:
        progress.message(
            "the nominal model is worse than predicting zero: check signs and units (`convention` of the sensor map)"
            " and the synchronisation of track and vehicle before the result"
        )
    base = _calibrated_base(context, nominal)
    progress.event(ModelValidated("before", base.validation))
    context = with_noise_within_residual(context, base.validation)
    selection = StepwiseSelection(context).select_effects(base.fit, base.validation, base.windowed)
    better = _better_base(context, base, selection, nominal)
    if better is not None:
        base = better
        progress.event(ModelValidated("before", base.validation))
        selection = StepwiseSelection(context).select_effects(base.fit, base.validation)
    result = _conclude(context, base, selection)
    withdrawn = _withdrawn_findings(result, findings)
    left = tuple(f for f in findings if f not in withdrawn)
    return replace(result, findings=left, withdrawn=withdrawn, seconds=time.perf_counter() - started)


def _withdrawn_findings(result: LoopResult, findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return the findings of the data checks that a model which leaves nothing but noise contradicts."""
    if result.verdict not in (Verdict.NONE, Verdict.EFFECT) or result.is_out_of_time or result.is_by_condition:
        return ()
    withdrawn = contradicted_gains(result.context, result.after.model, findings)
    for finding in withdrawn:
        result.context.progress.message(f"withdrawn, the final model needs no such gain: {finding.text}")
    return withdrawn


class _Base(NamedTuple):
    """The model from which effects are selected, its validation, and that fitted on windows where it hunts."""

    fit: Fit
    validation: Validation
    windowed: Fit | None
    is_failed: bool


def _calibrated_base(context: Context, nominal: Validation) -> _Base:
    """Calibrate; return the nominal model where the calibration failed.

    A calibrated model that is worse on the validation runs than the nominal one, and not at the noise floor of the
    estimation runs, has ended in a local minimum; no structure can be detected in its residual. This does not apply
    where the data demand a vehicle that hunts, which a stable one cannot follow.
    """
    fit, windowed = refit_hunting(context, calibrate(context))
    validation = validate(context, fit.model, context.dataset.selection)
    if windowed is None:
        fit, windowed, validation = retry_failed_fit(context, fit, nominal, validation)
    hunts = windowed is not None and not windowed.slips
    if hunts or not has_failed(context, fit, nominal, validation):
        return _Base(fit, validation, windowed, is_failed=False)
    context.progress.message(
        f"the calibration failed: NRMSE {validation.nrmse:.4f} on the validation runs, "
        f"{nominal.nrmse:.4f} with the nominal model, which is used instead"
    )
    start = stable_start(context)
    if start is not context.nominal:
        nominal = validate(context, start, context.dataset.selection)
    return _Base(fit_without_iteration(context, start), nominal, windowed, is_failed=True)


def _better_base(context: Context, base: _Base, selection: Selection, nominal: Validation) -> _Base | None:
    """Calibrate again from the estimates of the best model with an effect; None where that ends no better.

    The calibration may have ended in a local minimum, which any effect helps to leave. An effect counts against the
    best model without it.
    """
    refits = [r.fit for r in selection.steps[0].refits if r.candidate is not None] if selection.steps else []
    best = selection.fit if selection.has_effects else min(refits, key=lambda f: f.normal.rss, default=None)
    if best is None or base.windowed is not None or context.is_out_of_time:
        return None
    fit = calibrate_from(context, base.fit, best.model)
    if fit is None:
        return None
    validation = validate(context, fit.model, context.dataset.selection)
    if not validation.nrmse <= base.validation.nrmse or has_failed(context, fit, nominal, validation):
        return None  # no better, or it diverges
    context.progress.message(
        "the calibration had ended in a local minimum; from the estimates with an effect, without the effect: "
        f"NRMSE {base.validation.nrmse:.4f} -> {validation.nrmse:.4f}; selecting again"
    )
    return _Base(fit, validation, None, is_failed=False)


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


def _conclude(context: Context, base: _Base, selection: Selection) -> LoopResult:
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
    context, discrepancy, is_cut = examination.context, examination.discrepancy, examination.is_out_of_time
    scores = selection.final_score_test
    final, (predicted_gains, left_out) = run_both(
        lambda: _validated_final_fit(context, base, selection, examination),
        lambda: ({}, []) if is_cut else _first_order_forecasts(context, selection.fit, validation_fit, scores),
        context.jobs,
    )
    fit, base_fit, validations, floor = final
    compared, decisive_scores = (validations, floor), scores
    if deciding is not None:  # the score test is of the residual with common parameters
        compared = {"before": base.validation, "after": deciding.separate}, examination.floor
        decisive_scores = NO_SCORE_TEST
    errors, noise = compared
    explained = explained_share(errors["before"], errors["after"], noise)
    remainder = describe_remainder(context, errors, noise, examination.evidence, decisive_scores, discrepancy)
    test = run_independent_test(context, base_fit, fit, discrepancy)
    verdict = decide_verdict(
        context.settings.verdict,
        has_effects=selection.has_effects if deciding is None else selection.fit is not base.fit,
        explained=explained,
        remainder=remainder,
        is_adequate=examination.is_adequate,
        is_noise=examination.is_noise,
        has_discrepancy=discrepancy is not None,
        has_freed_members=freed_members_lower_error(context, selection.freed, selection.validation),
        is_out_of_time=is_cut,
        diverges=bool(errors["after"].diverged),
        is_contradicted=deciding is None and test is not None and test.is_contradicted,
        exceeds_noise=not errors["after"].nrmse <= context.settings.verdict.max_noise_ratio * noise.nrmse,
    )
    context.progress.message(f"verdict {verdict}: NRMSE {errors['after'].nrmse:.4f}, noise floor {noise.nrmse:.4f}")
    is_unexplained = verdict in (Verdict.OUTSIDE, Verdict.PARTIAL) and not is_cut
    return LoopResult(
        context,
        before=base_fit,
        after=fit,
        validations=validations,
        noise_floor=floor,
        steps=selection.steps,
        score_test=scores,
        verdict=verdict,
        explained=explained,
        remainder=remainder,
        test=test,
        discrepancy=discrepancy,
        windowed=base.windowed,
        is_failed_fit=base.is_failed,
        has_track_noise=examination.has_track_noise,
        is_out_of_time=is_cut,
        left_out=tuple(left_out),
        predicted_gains=predicted_gains,
        freed=selection.freed,
        conditions=conditions,
        is_by_condition=deciding is not None,
        sensitive_motion=_sensitive_motion(context, selection) if is_unexplained else None,
    )


def _sensitive_motion(context: Context, selection: Selection) -> SensitiveMotion | None:
    """Find a law with a sensitive motion where the selected model does not follow the runs."""
    return find_sensitive_motion(context, selection.fit, selection.validation)


class _Final(NamedTuple):
    """The final fit, the one without effects, their validations on the whole runs, and the noise floor there."""

    fit: Fit
    base_fit: Fit
    validations: dict[str, Validation]
    floor: NoiseFloor


def _validated_final_fit(context: Context, base: _Base, selection: Selection, examination: _Examination) -> _Final:
    """Take the last step of the estimation, and validate the model on the whole runs."""
    discrepancy = examination.discrepancy
    is_cut = examination.is_out_of_time
    fit = _final_fit(context, base, selection, discrepancy, examination.floor, is_cut=is_cut)
    base_fit = fit if selection.fit is base.fit and discrepancy is None else base.fit
    validations, floor = run_both(
        lambda: _final_validations(context, base_fit, fit, discrepancy),
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


def _final_validations(
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


def _examine(context: Context, base: _Base, selection: Selection, validation_fit: Fit | None) -> _Examination:
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
    if discrepancy is not None and may_be_track_noise(context, discrepancy):
        with_noise = with_track_noise(context, selection.fit.model, selection.validation, floor)
        if with_noise is not None:
            (context, floor), discrepancy = with_noise, None
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
    base: _Base,
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


def final_estimates(context: Context, fit: Fit, validation: Validation) -> Fit:
    """Take the last step of the estimation, unless it raises the misfit of the validation runs by too much."""
    last = with_spread_of_held_parameters(context, with_unbiased_estimates(context, fit))
    if last.shift.size:
        limit = (1.0 + context.settings.calibration.bias_misfit_share) ** 0.5 * validation.nrmse
        is_as_good = validate(context, last.model, context.dataset.selection).nrmse <= limit
        last = last if is_as_good else with_shift_as_spread(fit, last)
    return with_parameter_samples(context, last)


def report_data_checks(context: Context, diagnosis: Diagnosis | None = None) -> tuple[Finding, ...]:
    """Check the data and report the findings before anything is fitted to them."""
    findings = check_data(context.dataset, diagnosis, context.jobs)
    for f in findings:
        if f.check != "ceiling":
            context.progress.message(f"{'check this first: ' if f.serious else ''}{f.file}: {f.text}")
    return tuple(findings)


def calibrate_only(
    dataset: Dataset,
    *,
    method: str = METHODS[0],
    seed: int = 0,
    jobs: int | None = None,
    progress: Progress = SILENT,
) -> LoopResult:
    """Calibrate and validate the nominal model, without any search for effects.

    Parameters
    ----------
    method
        least-squares: all parameters at once; two-parallel-models: Broersen's method, one difference of two models at
        a time.

    Raises
    ------
    ValueError
        For an unknown method.
    """
    if method not in METHODS:
        raise ValueError(f"no method {method!r}: {' or '.join(METHODS)}")
    started = time.perf_counter()
    context = create_context(dataset, seed=seed, jobs=jobs, progress=progress)
    findings = report_data_checks(context)
    context = with_phases(context)
    nominal = validate(context, context.nominal, dataset.selection)
    if method == METHODS[0]:
        base = _with_final_estimates(context, _calibrated_base(context, nominal))
    else:
        base = _base_of_parallel_models(context, nominal)
    before = base.fit
    validations = _final_validations(context, before, before, None)
    floor = estimate_noise_floor(context, before.model, dataset.validation)
    step = SelectionStep(NO_SCORE_TEST, (), None)
    remainder = describe_remainder(context, validations, floor, NOT_EXAMINED, NO_SCORE_TEST, None)
    test = run_independent_test(context, before, before, None)
    seconds = time.perf_counter() - started
    return LoopResult(
        context,
        before=before,
        after=before,
        validations=validations,
        noise_floor=floor,
        steps=(step,),
        score_test=NO_SCORE_TEST,
        verdict=Verdict.NONE,
        explained=None,
        remainder=remainder,
        test=test,
        discrepancy=None,
        windowed=base.windowed,
        seconds=seconds,
        findings=findings,
        is_failed_fit=base.is_failed,
    )


def _with_final_estimates(context: Context, base: _Base) -> _Base:
    """Take the last step of the estimation as a loop does that adds no effect."""
    if base.is_failed:
        return base
    floor = estimate_noise_floor(context, base.fit.model, context.dataset.selection)
    context = with_level_of_residual(context, base.fit.model, base.validation, floor)
    return base._replace(fit=final_estimates(context, base.fit, base.validation))


def _base_of_parallel_models(context: Context, nominal: Validation) -> _Base:
    """Calibrate by Broersen's method."""
    start = stable_start(context)
    fit = two_parallel_models(context, start, prepare_segments(context, start, context.dataset.estimation))
    validation = validate(context, fit.model, context.dataset.selection)
    return _Base(fit, validation, None, has_failed(context, fit, nominal, validation))
