"""The loop: calibrate, test the residual for unmodelled effects, add them, calibrate again, validate."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import replace

from railui.campaign.data_checks import check_data
from railui.campaign.dataset import Dataset
from railui.campaign.faults.fault import Diagnosis
from railui.campaign.finding import Finding
from railui.identification.base_model import base_of_parallel_models, better_base, calibrated_base
from railui.identification.conclusion import conclude, final_validations, with_final_estimates
from railui.identification.context import Context, create_context
from railui.identification.estimation.calibration import (
    with_phases,
)
from railui.identification.estimation.noise_floor import estimate_noise_floor
from railui.identification.estimation.validation import validate
from railui.identification.events import ModelValidated
from railui.identification.remainder import describe_remainder
from railui.identification.residual.noise_evidence import (
    NOT_EXAMINED,
)
from railui.identification.residual.sensor_noise_bound import with_noise_within_residual
from railui.identification.residual.withdrawn_gains import contradicted_gains
from railui.identification.result import LoopResult, run_independent_test
from railui.identification.structure.candidate_scores import NO_SCORE_TEST
from railui.identification.structure.stage import SelectionStep
from railui.identification.structure.stepwise import StepwiseSelection
from railui.identification.verdict import Verdict
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
    base = calibrated_base(context, nominal)
    progress.event(ModelValidated("before", base.validation))
    context = with_noise_within_residual(context, base.validation)
    selection = StepwiseSelection(context).select_effects(base.fit, base.validation, base.windowed)
    better = better_base(context, base, selection, nominal)
    if better is not None:
        base = better
        progress.event(ModelValidated("before", base.validation))
        selection = StepwiseSelection(context).select_effects(base.fit, base.validation)
    result = conclude(context, base, selection)
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
    is_least_squares = method == METHODS[0]
    base = calibrated_base(context, nominal) if is_least_squares else base_of_parallel_models(context, nominal)
    context = with_noise_within_residual(context, base.validation)
    if is_least_squares:
        base = with_final_estimates(context, base)
    before = base.fit
    validations = final_validations(context, before, before, None)
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


def report_data_checks(context: Context, diagnosis: Diagnosis | None = None) -> tuple[Finding, ...]:
    """Check the data and report the findings before anything is fitted to them."""
    findings = check_data(context.dataset, diagnosis, context.jobs)
    for f in findings:
        if f.check != "ceiling":
            context.progress.message(f"{'check this first: ' if f.serious else ''}{f.file}: {f.text}")
    return tuple(findings)
