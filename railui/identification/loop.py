"""The loop: calibrate, test the residual for unmodelled effects, add them, calibrate again, validate."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from railui.campaign.data_checks import check_data
from railui.campaign.dataset import Dataset, Segment
from railui.campaign.finding import Finding
from railui.identification.context import Context, create_context
from railui.identification.estimation.calibration import calibrate, with_phases, with_stable_start
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.multiple_shooting import refit_hunting
from railui.identification.estimation.noise_floor import NoiseFloor, estimate_noise_floor
from railui.identification.estimation.parallel_models import two_parallel_models
from railui.identification.estimation.problem import prepare_segments
from railui.identification.estimation.validation import Validation, validate
from railui.identification.events import ModelValidated
from railui.identification.structure.gain_forecast import PredictedGains, predict_validation_gain
from railui.identification.structure.score_test import ScoreTestResult
from railui.identification.structure.stepwise import SelectionStep, StepwiseSelection
from railui.identification.unmodelled.discrepancy import find_discrepancy
from railui.identification.unmodelled.locate import Discrepancy
from railui.identification.unmodelled.run_dependence import prepare_validation
from railui.progress import SILENT, Progress
from railui.vehicle.model import Model

METHODS = ("least-squares", "two-parallel-models")
NO_SCORE_TEST = ScoreTestResult((), (), 1.0, float("inf"), 0.0)


@dataclass(frozen=True, eq=False)
class LoopResult:
    """Result of the loop, from which the report is made.

    Attributes
    ----------
    before, after
        The calibrated model without effects, and with those selected.
    validations
        On the validation runs, by declared, before and after.
    verdict
        effect, outside (not in the library) or none.
    windowed
        The model without effects fitted on windows, where the vehicle hunts.
    predicted_gains
        On the validation runs, of the candidates of the last score test.
    """

    context: Context
    before: Fit
    after: Fit
    validations: dict[str, Validation]
    noise_floor: NoiseFloor
    steps: tuple[SelectionStep, ...]
    score_test: ScoreTestResult
    verdict: str
    discrepancy: Discrepancy | None
    seconds: float
    findings: tuple[Finding, ...] = ()
    windowed: Fit | None = None
    predicted_gains: PredictedGains = field(default_factory=dict, repr=False)

    @property
    def dataset(self) -> Dataset:
        """The measured runs."""
        return self.context.dataset

    @property
    def nominal(self) -> Model:
        """The nominal model."""
        return self.context.nominal

    @property
    def seed(self) -> int:
        """Seed of every random draw."""
        return self.context.seed

    @property
    def error_to_noise(self) -> float:
        """Validation error over noise floor."""
        return self.validations["after"].nrmse / self.noise_floor.nrmse

    def validate(self, segments: Sequence[Segment]) -> Validation:
        """Validate the final model on segments."""
        if self.discrepancy is not None and self.discrepancy.lowers_error:
            return self.discrepancy.validate(self.context, segments)
        return validate(self.context, self.after.model, segments)


def close_loop(
    dataset: Dataset,
    *,
    without: Collection[str] = (),
    seed: int = 0,
    jobs: int | None = None,
    progress: Progress = SILENT,
) -> LoopResult:
    """Close the loop on a dataset. The validation runs select effects; no parameter is fitted to them.

    Parameters
    ----------
    without
        Kinds of effects that may not be proposed.
    progress
        Receives messages, and as events `ModelValidated`, the `FitIteration` of the main fits, `ScoreTestProgress`,
        each `ScoreTestResult`, the `ScoreResult` about to be refitted, its `Refit`, and the `NoiseFloor`.
    """
    started = time.perf_counter()
    context = create_context(dataset, seed=seed, jobs=jobs, progress=progress, excluded=without)
    findings = report_data_checks(context)
    context = with_phases(context)
    validations = {"declared": validate(context, context.nominal, dataset.validation)}
    progress.event(ModelValidated("declared", validations["declared"]))
    progress.message(f"nominal model: NRMSE {validations['declared'].nrmse:.4f} on the validation runs")
    before, windowed = refit_hunting(context, calibrate(context))
    validations["before"] = validate(context, before.model, dataset.validation)
    progress.event(ModelValidated("before", validations["before"]))
    selection = StepwiseSelection(context).select_effects(before, validations["before"], windowed)
    fit, validations["after"] = selection.fit, selection.validation
    floor = estimate_noise_floor(context, fit.model, dataset.validation)
    progress.event(floor)
    validation_fit = prepare_validation(context, fit)
    predicted_gains = predict_validation_gain(context, validation_fit, selection.final_score_test)
    start = windowed if fit is before and windowed is not None else fit
    error_to_noise = selection.validation.nrmse / floor.nrmse
    discrepancy = find_discrepancy(context, start, validation_fit, selection, error_to_noise)
    if discrepancy is not None and discrepancy.lowers_error:
        fit, validations["after"] = discrepancy.fit, discrepancy.validation
        floor = estimate_noise_floor(context, fit.model, dataset.validation)
    verdict = "outside" if discrepancy else "effect" if selection.has_effects else "none"
    progress.message(f"verdict {verdict}: NRMSE {validations['after'].nrmse:.4f}, noise floor {floor.nrmse:.4f}")
    return LoopResult(
        context,
        before,
        fit,
        validations,
        floor,
        selection.steps,
        selection.final_score_test,
        verdict,
        discrepancy,
        time.perf_counter() - started,
        findings,
        windowed,
        predicted_gains,
    )


def report_data_checks(context: Context) -> tuple[Finding, ...]:
    """Check the data and report the findings before anything is fitted to them."""
    findings = check_data(context.dataset)
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
    if method == METHODS[0]:
        before = calibrate(context)
    else:
        start = with_stable_start(context, dataset.estimation)
        before, _ = two_parallel_models(context, start, prepare_segments(context, start, dataset.estimation))
    validations = {
        "declared": validate(context, context.nominal, dataset.validation),
        "before": validate(context, before.model, dataset.validation),
    }
    validations["after"] = validations["before"]
    floor = estimate_noise_floor(context, before.model, dataset.validation)
    step = SelectionStep(NO_SCORE_TEST, (), None)
    seconds = time.perf_counter() - started
    return LoopResult(
        context, before, before, validations, floor, (step,), NO_SCORE_TEST, "none", None, seconds, findings
    )


def indistinguishable_kinds(context: Context, step: SelectionStep) -> list[str]:
    """List the kinds that fit at the location of the added effect as well as it does."""
    if step.added is None or step.added.candidate is None:
        return []
    ratio = context.settings.selection.indistinguishable_ratio
    best = min(float(r.block_errors.sum()) for r in step.refits)
    location = step.added.candidate.at
    similar = [
        r.candidate.kind
        for r in step.refits
        if r.candidate is not None and r.candidate.at == location and np.sqrt(r.block_errors.sum() / best) <= ratio
    ]
    return list(dict.fromkeys([step.added.candidate.kind, *similar]))
