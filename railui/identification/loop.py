"""The loop: adjust, find the residual, trace it to an effect that the model lacks, add it, adjust again, judge."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from railui.campaign.data_checks import gate
from railui.campaign.dataset import Measurement, Stretch
from railui.campaign.finding import Finding
from railui.identification.estimation.initial_state import with_phases
from railui.identification.estimation.multiple_shooting import NEAR, cut_where, held, hunting, pieces
from railui.identification.estimation.output_error import STABLE, Fit, adjust
from railui.identification.estimation.parallel_models import two_parallel_models
from railui.identification.estimation.problem import restarted, targets
from railui.identification.estimation.validation import Floor, Judgement, floor, judge
from railui.identification.events import Judged
from railui.identification.structure.gain_forecast import Foreseen, foresee
from railui.identification.structure.score_test import Trace
from railui.identification.structure.stepwise import ADEQUATE, UNEXPLAINED, Search, Step, Terms, material, structured
from railui.identification.unmodelled.locate import Outside, look_along, look_between, look_outside, telling
from railui.identification.unmodelled.run_dependence import laid
from railui.progress import Report, Watch, silent, unwatched
from railui.vehicle.model import Model

RINGING = 4  # times that the initial state of a rig is estimated anew: it rings as long as it is recorded
SOFTER = 20  # times that a start is made less conical
LOOKALIKE = 1.10  # within so much of the best error, judged on what no fit saw, two laws look alike
OF_ITS_OWN = 1 / 3  # of the excess over the floor, up to which the adjusting runs are at theirs
METHODS = ("least-squares", "two-parallel-models")
NOTHING = Trace((), (), 1.0, float("inf"), 0.0)  # nothing was traced


@dataclass(frozen=True, eq=False)
class Found:
    """All that the loop found; the report is made of it."""

    measurement: Measurement
    declared: Model
    before: Fit
    after: Fit
    judged: dict[str, Judgement]
    floor: Floor
    steps: tuple[Step, ...]
    last: Trace
    verdict: str
    outside: Outside | None
    seconds: float
    seed: int
    gate: tuple[Finding, ...] = ()
    hunting: Fit | None = None  # without an effect on windows, where the vehicle hunts
    foreseen: Foreseen = field(default_factory=dict, repr=False)  # of the last trace, on the validating runs

    @property
    def unexplained(self) -> float:
        """Error over floor."""
        return self.judged["after"].nrmse / self.floor.nrmse

    def judge(self, stretches: Sequence[Stretch]) -> Judgement:
        """The vehicle as found, on stretches."""
        if self.outside is not None and self.outside.gains:
            return self.outside.judged(self.measurement, stretches)
        return judge(self.after.model, self.measurement, stretches)


def declared_on(measurement: Measurement) -> Model:
    """The declared vehicle, what turns as each adjusting run met it: phases estimated, to be fitted with all else."""
    model = Model(measurement.campaign.design, measurement.campaign.sensors)
    for stretch in measurement.adjust:
        model = with_phases(model, stretch, measurement.noise)
    return model


def adjusted(
    measurement: Measurement,
    declared: Model,
    *,
    jobs: int | None = None,
    report: Report = silent,
    watch: Watch = unwatched,
) -> Fit:
    """The declared vehicle adjusted: once for weights and initial states, once with them renewed."""
    paths = measurement.campaign.adjust
    free = held(declared)
    start = declared if free else stabilised(declared, measurement.adjust)
    if start is not declared:
        report("the declared vehicle is unstable at a speed of the campaign: the fit starts at a lower conicity")
    cut = cut_where(declared, measurement.adjust, NEAR) if free else set()
    ready = targets(start, measurement, pieces(measurement.adjust, cut))
    fit = adjust(
        start, measurement, paths, declared, ready=ready, stable=not free, tolerance=1e-4, jobs=jobs, watch=watch
    )
    report(f"adjusted {len(paths)} parameters in {fit.iterations} iterations, once more with the noise as it arrives")
    spent = fit.simulations
    for _ in range(RINGING if declared.design.kind == "rig" else 1):
        ready = restarted(fit.model, fit.targets, measurement)
        fit = adjust(fit.model, measurement, paths, declared, ready=ready, stable=not free, jobs=jobs, watch=watch)
        spent += fit.simulations
    return replace(fit, simulations=spent)


def stabilised(declared: Model, stretches: Sequence[Stretch]) -> Model:
    """The declared vehicle, or one of lower conicity that is stable at every speed of the stretches, to start from."""
    if declared.design.kind != "bogie":
        return declared
    model = declared
    conicities = [f"contact.{where}.conicity" for where in ("leading", "trailing")]
    for _ in range(SOFTER):
        if not cut_where(model, stretches, STABLE):
            break
        lower = np.array([0.8 * model.design.values[c] for c in conicities])
        model = model.with_row(conicities, lower)
    return model


def close_loop(
    measurement: Measurement,
    *,
    without: Collection[str] = (),
    seed: int = 0,
    jobs: int | None = None,
    report: Report = silent,
    watch: Watch = unwatched,
) -> Found:
    """Close the loop on a measurement. The validating runs judge; no fit sees them.

    `report` is told lines; `watch` gets `Judged`, the `Turn`s of the main fits, `Looked` of the trace, each `Trace`,
    the `Sighting` about to be confirmed, its `Refit`, and `Floor`.
    """
    began = time.perf_counter()
    findings = passed_gate(measurement, report)
    declared = declared_on(measurement)
    judged = {"declared": judge(declared, measurement, measurement.validate)}
    watch(Judged("declared", judged["declared"]))
    report(f"declared vehicle: nrmse {judged['declared'].nrmse:.4f}")
    before = adjusted(measurement, declared, jobs=jobs, report=report, watch=watch)
    before, wild = hunting(before, measurement, declared, jobs=jobs, report=report, watch=watch)
    judged["before"] = judge(before.model, measurement, measurement.validate)
    watch(Judged("before", judged["before"]))
    search = Search(measurement, declared, frozenset(without), seed, jobs, report, watch)
    terms = search.terms(before, judged["before"], wild)
    fit, judged["after"] = terms.fit, terms.judgement
    noise = floor(fit.model, measurement, measurement.validate, jobs=jobs)
    watch(noise)
    here = laid(fit, measurement)
    foreseen = foresee(here, terms.last, measurement, jobs=jobs)
    from_here = wild if fit is before and wild is not None else fit
    outside = missing(from_here, here, terms, noise, measurement, declared, seed=seed, jobs=jobs, report=report)
    if outside is not None and outside.gains:
        fit, judged["after"] = outside.fit, outside.judgement
        noise = floor(fit.model, measurement, measurement.validate, jobs=jobs)
    verdict = "outside" if outside else "effect" if terms.added else "none"
    report(f"verdict {verdict}: nrmse {judged['after'].nrmse:.4f}, floor {noise.nrmse:.4f}")
    return Found(
        measurement, declared, before, fit, judged, noise, terms.steps, terms.last, verdict, outside,
        time.perf_counter() - began, seed, findings, wild, foreseen,
    )  # fmt: skip


def missing(
    fit: Fit,
    here: Fit | None,
    terms: Terms,
    noise: Floor,
    measurement: Measurement,
    declared: Model,
    *,
    seed: int = 0,
    jobs: int | None = None,
    report: Report = silent,
) -> Outside | None:
    """What acts beside the terms found and is not in the catalogue; None where noise explains what they leave.

    `fit`: the vehicle that the search starts from, with these terms; `here`: it on the validating runs.
    """
    ratio = terms.judgement.nrmse / noise.nrmse
    if ratio <= ADEQUATE:
        return None

    def between() -> Outside | None:
        return look_between(fit, here, terms.judgement, measurement, declared, seed=seed, jobs=jobs, report=report)

    def within() -> Outside | None:
        return acting(fit, terms, ratio, measurement, declared, jobs=jobs, report=report)

    looks = (between, within) if own_floor(fit, ratio) else (within, between)
    return next((found for look in looks if (found := look()) is not None), None)


def acting(
    fit: Fit,
    terms: Terms,
    ratio: float,
    measurement: Measurement,
    declared: Model,
    *,
    jobs: int | None = None,
    report: Report = silent,
) -> Outside | None:
    """What the adjusting runs say of something that acts beside the terms found, so many times the floor being left."""
    shaped = structured(terms.last)
    along = look_along(fit, measurement, report)
    seen = along
    if not ratio <= UNEXPLAINED or shaped or telling(along):
        seen = look_outside(fit, measurement, declared, along, jobs=jobs, report=report)
    if seen is None:
        return None
    gains = material(terms.judgement, seen.judgement, measurement.campaign.material)
    # three effects that leave something of a shape are not what is missing
    lost = ratio > UNEXPLAINED and (shaped or not terms.added)
    return replace(seen, gains=gains) if gains or telling(seen) or lost else None


def own_floor(fit: Fit, ratio: float) -> bool:
    """Are the adjusting runs at their floor, where so many times the floor is left on the validating ones?"""
    return fit.rest - 1.0 < OF_ITS_OWN * (ratio - 1.0)


def passed_gate(measurement: Measurement, report: Report) -> tuple[Finding, ...]:
    """What is wrong with the data, told before anything is fitted to them."""
    findings = gate(measurement)
    for f in findings:
        if f.check != "ceiling":
            report(f"{'check this first: ' if f.serious else ''}{f.file}: {f.text}")
    return tuple(findings)


def adjust_only(
    measurement: Measurement,
    *,
    method: str = METHODS[0],
    seed: int = 0,
    jobs: int | None = None,
    report: Report = silent,
    watch: Watch = unwatched,
) -> Found:
    """The first half of the loop: the declared vehicle adjusted and judged, nothing traced.

    method: least squares over all parameters at once, or Broersen's own, one difference of two models at a time.
    Raises ValueError for an unknown method.
    """
    if method not in METHODS:
        raise ValueError(f"no method {method!r}: {' or '.join(METHODS)}")
    began = time.perf_counter()
    findings = passed_gate(measurement, report)
    declared = declared_on(measurement)
    if method == METHODS[0]:
        before = adjusted(measurement, declared, jobs=jobs, report=report, watch=watch)
    else:
        start = stabilised(declared, measurement.adjust)
        ready = targets(start, measurement, measurement.adjust)
        paths = measurement.campaign.adjust
        before, _ = two_parallel_models(start, measurement, paths, declared, ready, jobs=jobs, report=report)
    judged = {
        "declared": judge(declared, measurement, measurement.validate),
        "before": judge(before.model, measurement, measurement.validate),
    }
    judged["after"] = judged["before"]
    noise = floor(before.model, measurement, measurement.validate, jobs=jobs)
    seconds = time.perf_counter() - began
    return Found(
        measurement, declared, before, before, judged, noise, (Step(NOTHING, (), None),), NOTHING, "none", None,
        seconds, seed, findings,
    )  # fmt: skip


def lookalikes(step: Step) -> list[str]:
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
