"""The loop: adjust, find the residual, trace it to an effect that the model lacks, add it, adjust again, judge."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from railui.campaign.data_checks import check_data
from railui.campaign.dataset import Dataset, Segment
from railui.campaign.finding import Finding
from railui.identification.estimation.initial_state import estimate_phases
from railui.identification.estimation.multiple_shooting import (
    NEAR,
    cut_into_windows,
    limits_hunting,
    refit_hunting,
    unstable_segments,
)
from railui.identification.estimation.output_error import STABLE, Fit, fit_output_error
from railui.identification.estimation.parallel_models import two_parallel_models
from railui.identification.estimation.problem import reprepare_segments, prepare_segments
from railui.identification.estimation.validation import NoiseFloor, Validation, estimate_noise_floor, validate
from railui.identification.events import ModelValidated
from railui.identification.structure.gain_forecast import PredictedGains, predict_validation_gain
from railui.identification.structure.score_test import ScoreTestResult
from railui.identification.structure.stepwise import (
    ADEQUATE,
    UNEXPLAINED,
    Selection,
    SelectionStep,
    StepwiseSelection,
    has_structure,
    is_significant_gain,
)
from railui.identification.unmodelled.locate import (
    Discrepancy,
    find_run_dependence,
    find_variation_along_track,
    is_conclusive,
    locate_discrepancy,
)
from railui.identification.unmodelled.run_dependence import prepare_validation
from railui.progress import Report, Watch, silent, unwatched
from railui.vehicle.model import Model

RINGING = 4  # times that the initial state of a rig is estimated anew: it rings as long as it is recorded
SOFTER = 20  # times that a start is made less conical
LOOKALIKE = 1.10  # within so much of the best error, judged on what no fit saw, two laws look alike
OF_ITS_OWN = 1 / 3  # of the excess over the floor, up to which the adjusting runs are at theirs
METHODS = ("least-squares", "two-parallel-models")
NOTHING = ScoreTestResult((), (), 1.0, float("inf"), 0.0)  # nothing was traced


@dataclass(frozen=True, eq=False)
class LoopResult:
    """All that the loop found; the report is made of it."""

    dataset: Dataset
    nominal: Model
    before: Fit
    after: Fit
    validations: dict[str, Validation]
    noise_floor: NoiseFloor
    steps: tuple[SelectionStep, ...]
    score_test: ScoreTestResult
    verdict: str
    discrepancy: Discrepancy | None
    seconds: float
    seed: int
    findings: tuple[Finding, ...] = ()
    windowed: Fit | None = None  # without an effect on windows, where the vehicle hunts
    predicted_gains: PredictedGains = field(default_factory=dict, repr=False)  # of the last trace, on the validating runs

    @property
    def error_to_noise(self) -> float:
        """Error over floor."""
        return self.validations["after"].nrmse / self.noise_floor.nrmse

    def validate(self, stretches: Sequence[Segment]) -> Validation:
        """The vehicle as found, on stretches."""
        if self.discrepancy is not None and self.discrepancy.gains:
            return self.discrepancy.judged(self.dataset, stretches)
        return validate(self.after.model, self.dataset, stretches)


def nominal_model(measurement: Dataset) -> Model:
    """The declared vehicle, what turns as each adjusting run met it: phases estimated, to be fitted with all else."""
    model = Model(measurement.campaign.design, measurement.campaign.sensors)
    for stretch in measurement.estimation:
        model = estimate_phases(model, stretch, measurement.noise)
    return model


def calibrate(
    measurement: Dataset,
    declared: Model,
    *,
    jobs: int | None = None,
    report: Report = silent,
    watch: Watch = unwatched,
) -> Fit:
    """The declared vehicle adjusted: once for weights and initial states, once with them renewed."""
    paths = measurement.campaign.estimated_parameters
    free = limits_hunting(declared)
    start = declared if free else with_stable_start(declared, measurement.estimation)
    if start is not declared:
        report("the declared vehicle is unstable at a speed of the campaign: the fit starts at a lower conicity")
    cut = unstable_segments(declared, measurement.estimation, NEAR) if free else set()
    ready = prepare_segments(start, measurement, cut_into_windows(measurement.estimation, cut))
    fit = fit_output_error(
        start, measurement, paths, declared, ready=ready, stable=not free, tolerance=1e-4, jobs=jobs, watch=watch
    )
    report(f"adjusted {len(paths)} parameters in {fit.iterations} iterations, once more with the noise as it arrives")
    spent = fit.simulations
    for _ in range(RINGING if declared.design.kind == "rig" else 1):
        ready = reprepare_segments(fit.model, fit.segments, measurement)
        fit = fit_output_error(
            fit.model, measurement, paths, declared, ready=ready, stable=not free, jobs=jobs, watch=watch
        )
        spent += fit.simulations
    return replace(fit, simulations=spent)


def with_stable_start(declared: Model, stretches: Sequence[Segment]) -> Model:
    """The declared vehicle, or one of lower conicity that is stable at every speed of the stretches, to start from."""
    if declared.design.kind != "bogie":
        return declared
    model = declared
    conicities = [f"contact.{where}.conicity" for where in ("leading", "trailing")]
    for _ in range(SOFTER):
        if not unstable_segments(model, stretches, STABLE):
            break
        lower = np.array([0.8 * model.design.values[c] for c in conicities])
        model = model.with_row(conicities, lower)
    return model


def close_loop(
    measurement: Dataset,
    *,
    without: Collection[str] = (),
    seed: int = 0,
    jobs: int | None = None,
    report: Report = silent,
    watch: Watch = unwatched,
) -> LoopResult:
    """Close the loop on a measurement. The validating runs judge; no fit sees them.

    `report` is told lines; `watch` gets `Judged`, the `Turn`s of the main fits, `Looked` of the trace, each `Trace`,
    the `Sighting` about to be confirmed, its `Refit`, and `Floor`.
    """
    began = time.perf_counter()
    findings = report_data_checks(measurement, report)
    declared = nominal_model(measurement)
    judged = {"declared": validate(declared, measurement, measurement.validation)}
    watch(ModelValidated("declared", judged["declared"]))
    report(f"declared vehicle: nrmse {judged['declared'].nrmse:.4f}")
    before = calibrate(measurement, declared, jobs=jobs, report=report, watch=watch)
    before, wild = refit_hunting(before, measurement, declared, jobs=jobs, report=report, watch=watch)
    judged["before"] = validate(before.model, measurement, measurement.validation)
    watch(ModelValidated("before", judged["before"]))
    search = StepwiseSelection(measurement, declared, frozenset(without), seed, jobs, report, watch)
    terms = search.select_effects(before, judged["before"], wild)
    fit, judged["after"] = terms.fit, terms.judgement
    noise = estimate_noise_floor(fit.model, measurement, measurement.validation, jobs=jobs)
    watch(noise)
    here = prepare_validation(fit, measurement)
    foreseen = predict_validation_gain(here, terms.last, measurement, jobs=jobs)
    from_here = wild if fit is before and wild is not None else fit
    outside = find_discrepancy(
        from_here, here, terms, noise, measurement, declared, seed=seed, jobs=jobs, report=report
    )
    if outside is not None and outside.gains:
        fit, judged["after"] = outside.fit, outside.judgement
        noise = estimate_noise_floor(fit.model, measurement, measurement.validation, jobs=jobs)
    verdict = "outside" if outside else "effect" if terms.added else "none"
    report(f"verdict {verdict}: nrmse {judged['after'].nrmse:.4f}, floor {noise.nrmse:.4f}")
    return LoopResult(
        measurement, declared, before, fit, judged, noise, terms.steps, terms.last, verdict, outside,
        time.perf_counter() - began, seed, findings, wild, foreseen,
    )  # fmt: skip


def find_discrepancy(
    fit: Fit,
    here: Fit | None,
    terms: Selection,
    noise: NoiseFloor,
    measurement: Dataset,
    declared: Model,
    *,
    seed: int = 0,
    jobs: int | None = None,
    report: Report = silent,
) -> Discrepancy | None:
    """What acts beside the terms found and is not in the catalogue; None where noise explains what they leave.

    `fit`: the vehicle that the search starts from, with these terms; `here`: it on the validating runs.
    """
    ratio = terms.judgement.nrmse / noise.nrmse
    if ratio <= ADEQUATE:
        return None

    def between() -> Discrepancy | None:
        return find_run_dependence(
            fit, here, terms.judgement, measurement, declared, seed=seed, jobs=jobs, report=report
        )

    def within() -> Discrepancy | None:
        return find_acting_discrepancy(fit, terms, ratio, measurement, declared, jobs=jobs, report=report)

    looks = (between, within) if is_at_noise_floor(fit, ratio) else (within, between)
    return next((found for look in looks if (found := look()) is not None), None)


def find_acting_discrepancy(
    fit: Fit,
    terms: Selection,
    ratio: float,
    measurement: Dataset,
    declared: Model,
    *,
    jobs: int | None = None,
    report: Report = silent,
) -> Discrepancy | None:
    """What the adjusting runs say of something that acts beside the terms found, so many times the floor being left."""
    shaped = has_structure(terms.last)
    along = find_variation_along_track(fit, measurement, report)
    seen = along
    if not ratio <= UNEXPLAINED or shaped or is_conclusive(along):
        seen = locate_discrepancy(fit, measurement, declared, along, jobs=jobs, report=report)
    if seen is None:
        return None
    gains = is_significant_gain(terms.judgement, seen.judgement, measurement.campaign.min_relative_gain)
    # three effects that leave something of a shape are not what is missing
    lost = ratio > UNEXPLAINED and (shaped or not terms.added)
    return replace(seen, gains=gains) if gains or is_conclusive(seen) or lost else None


def is_at_noise_floor(fit: Fit, ratio: float) -> bool:
    """Are the adjusting runs at their floor, where so many times the floor is left on the validating ones?"""
    return fit.error_to_noise - 1.0 < OF_ITS_OWN * (ratio - 1.0)


def report_data_checks(measurement: Dataset, report: Report) -> tuple[Finding, ...]:
    """What is wrong with the data, told before anything is fitted to them."""
    findings = check_data(measurement)
    for f in findings:
        if f.check != "ceiling":
            report(f"{'check this first: ' if f.serious else ''}{f.file}: {f.text}")
    return tuple(findings)


def calibrate_only(
    measurement: Dataset,
    *,
    method: str = METHODS[0],
    seed: int = 0,
    jobs: int | None = None,
    report: Report = silent,
    watch: Watch = unwatched,
) -> LoopResult:
    """The first half of the loop: the declared vehicle adjusted and judged, nothing traced.

    method: least squares over all parameters at once, or Broersen's own, one difference of two models at a time.
    Raises ValueError for an unknown method.
    """
    if method not in METHODS:
        raise ValueError(f"no method {method!r}: {' or '.join(METHODS)}")
    began = time.perf_counter()
    findings = report_data_checks(measurement, report)
    declared = nominal_model(measurement)
    if method == METHODS[0]:
        before = calibrate(measurement, declared, jobs=jobs, report=report, watch=watch)
    else:
        start = with_stable_start(declared, measurement.estimation)
        ready = prepare_segments(start, measurement, measurement.estimation)
        paths = measurement.campaign.estimated_parameters
        before, _ = two_parallel_models(start, measurement, paths, declared, ready, jobs=jobs, report=report)
    judged = {
        "declared": validate(declared, measurement, measurement.validation),
        "before": validate(before.model, measurement, measurement.validation),
    }
    judged["after"] = judged["before"]
    noise = estimate_noise_floor(before.model, measurement, measurement.validation, jobs=jobs)
    seconds = time.perf_counter() - began
    return LoopResult(
        measurement, declared, before, before, judged, noise, (SelectionStep(NOTHING, (), None),), NOTHING, "none", None,
        seconds, seed, findings,
    )  # fmt: skip


def indistinguishable_kinds(step: SelectionStep) -> list[str]:
    """Kinds that fit at the place of the added effect as well as it does."""
    if step.added is None or step.added.candidate is None:
        return []
    best = min(float(r.held_out.sum()) for r in step.refits)
    place = step.added.candidate.at
    alike = [
        r.candidate.kind
        for r in step.refits
        if r.candidate is not None and r.candidate.at == place and np.sqrt(r.held_out.sum() / best) <= LOOKALIKE
    ]
    return list(dict.fromkeys([step.added.candidate.kind, *alike]))
