"""Assessment of the loop on a blind trial: effect, class and location found, oracle error, coverage of intervals."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from railui import core
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.campaign.faults.diagnose import diagnose
from railui.identification.context import Context, create_context
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import prepare_segments
from railui.identification.estimation.validation import Validation, validate
from railui.identification.loop import close_loop
from railui.identification.result import LoopResult
from railui.identification.structure.stage import indistinguishable_kinds
from railui.vehicle.design_reader import PlacedEffect
from tests.blind.cases import PlantedCase, is_same_family, joint_of
from tests.blind.true_floor import Columns, true_noise_floor
from tests.truth.campaign import Campaign
from tests.truth.effects import Effect
from tests.truth.files import paths

NAN = float("nan")
MAX_ORACLE_RATIO = (
    0.9  # oracle error over the error before, up to which the planted effect can lower the error by a tenth
)
ADEQUATE_RATIO, UNEXPLAINED_RATIO = 1.10, 1.5  # error over noise floor
EQUIVALENT_LOCATIONS = {
    "contact": ("contact", "wheelset", "wheelset_yaw"),
    "wheelset": ("wheelset", "wheelset_yaw", "contact"),
    "frame": ("frame", "secondary_lateral"),
    "frame_yaw": ("frame_yaw", "secondary_yaw"),
}


@dataclass(frozen=True)
class TrialRow:
    """One campaign of a trial: planted effects, result of the loop, and whether it is right (None: not applicable)."""

    number: int
    sort: str
    planted: str
    nuisance: str
    verdict: str
    named: str
    right_name: bool | None = None
    right_class: bool | None = None
    right_place: bool | None = None
    declared: float = NAN
    before: float = NAN
    after: float = NAN
    floor: float = NAN
    oracle: float = NAN
    best_rho2: float = NAN
    sensors: str = ""
    scores: str = ""  # path=z of the true parameters: error over standard deviation
    without: str = ""  # result with the planted and the indistinguishable effects excluded
    admits: bool | None = None  # whether that result admits a discrepancy
    seconds: float = NAN
    cpu: float = NAN
    data_fault: str = ""  # diagnosed in these sound data
    problem: str = ""

    @property
    def z(self) -> dict[str, float]:
        """Errors of the estimates over their standard deviations, by path."""
        return {path: float(z) for path, z in (word.split("=") for word in self.scores.split())}

    @property
    def is_relevant(self) -> bool:
        """True if the planted effect raises the error enough to change a verdict."""
        best = self.oracle if self.oracle == self.oracle else self.floor
        return self.before * MAX_ORACLE_RATIO > best


@dataclass(frozen=True)
class Truth:
    """True numbers by their paths in design files, and the effects as they were on the estimation run.

    clean: columns without noise of every run, by its letter; empty: not known.
    """

    values: Mapping[str, float]
    effects: Sequence[Effect]
    clean: Mapping[str, Columns] = field(default_factory=dict)


def truth_of(case: PlantedCase, campaign: Campaign) -> Truth:
    """Return the truth of a bogie's campaign."""
    return Truth(paths(campaign.vehicle), campaign.effects["a"][: len(case.effects)], campaign.clean)


def run_case(
    case: PlantedCase, truth: Truth, folder: Path, excluded: bool = False, threads: int = 1
) -> tuple[TrialRow, LoopResult | None]:
    """Run the loop on a campaign of a trial; excluded: run it repeated with the planted effects excluded.

    The times of the row are those of reading the runs and of the loop on so many threads.
    """
    start, cpu_start = time.perf_counter(), time.process_time()
    identity = (case.order.seed, case.sort, case.text, case.nuisance)
    try:
        dataset = read_dataset(load_campaign(folder))
        result = close_loop(dataset, jobs=threads)
        seconds, cpu = time.perf_counter() - start, time.process_time() - cpu_start
        row = assess(case, result)
        faults = "; ".join(fault.text for fault in diagnose(dataset).serious)
        row = replace(row, data_fault=faults, seconds=seconds, cpu=cpu)
        row = replace(row, sensors=case.sensors, scores=_scores(row, case, truth, result))
        if case.sort in ("catalogue", "two", "three"):
            row = replace(row, oracle=oracle_error(create_context(dataset, jobs=1), truth))
        if case.sort == "outside" and truth.clean:
            context = create_context(dataset, jobs=1)
            row = replace(row, oracle=true_noise_floor(context, result.before.model, truth.clean))
        if excluded and row.right_class and case.effects:
            row = _repeat_without(row, case, dataset, result)
    except Exception as problem:
        text = f"{type(problem).__name__}: {problem}"
        row = TrialRow(*identity, "exception", "", False, False, False, sensors=case.sensors, problem=text)
        return row, None
    return row, result


def assess(case: PlantedCase, result: LoopResult) -> TrialRow:
    """Compare the result of the loop with the planted effects."""
    named = added_effects(result)
    words = [f"{e.kind} {e.at}{f' {e.wheelset}' if e.wheelset else ''}" for e in named]
    discrepancy = result.discrepancy
    locations = discrepancy.locations(result.context.settings.verdict) if discrepancy is not None else []
    if discrepancy is not None:
        found = " or ".join(f"{at} {number}" if number else at for at, number, _ in locations)
        words.append(f"outside {found}" if locations else "outside, not located")
    errors = {k: j.nrmse for k, j in result.validations.items()}
    name: bool | None
    kind: bool | None
    place: bool | None
    if case.sort in ("nothing", "limit"):
        name = kind = place = result.verdict == "none"
    elif case.sort == "outside":
        name, kind = None, result.verdict == "outside"
        true_at = joint_of(case.effects[0].at)
        possible = {joint_of(at) for at, _, _ in locations}
        place = bool(possible & {*EQUIVALENT_LOCATIONS.get(true_at, (true_at,))}) if possible else None
    else:
        classes = [kinds for step in result.steps if (kinds := indistinguishable_kinds(result.context, step))]
        first = [{x for kinds in classes for x in kinds if e.kind in kinds} | {e.kind} for e in named]
        pairs = [
            [(e, kinds) for e, kinds in zip(named, first, strict=True) if joint_of(e.at) == joint_of(p.at)]
            for p in case.effects
        ]
        name = all(any(e.kind == p.kind for e, _ in matches) for p, matches in zip(case.effects, pairs, strict=True))
        kind = all(
            any(p.kind in kinds or is_same_family(p.kind, e.kind) for e, kinds in matches)
            for p, matches in zip(case.effects, pairs, strict=True)
        )
        place = all(bool(matches) for matches in pairs)
    return TrialRow(
        case.order.seed, case.sort, case.text, case.nuisance, result.verdict, " + ".join(words), name, kind, place,
        errors["declared"], errors["before"], errors["after"], result.noise_floor.nrmse,
        best_rho2=result.steps[0].score_test.rho2,
    )  # fmt: skip


def added_effects(result: LoopResult) -> list[PlacedEffect]:
    """List the effects that the loop added to those of the nominal model."""
    nominal = {(e.kind, e.at, e.wheelset) for e in result.context.nominal.effects}
    effects = [e for e in result.after.model.effects if e.kind != "measured_force"]
    return [e for e in effects if (e.kind, e.at, e.wheelset) not in nominal]


def oracle_error(context: Context, truth: Truth) -> float:
    """Compute the validation error of the true structure: the best that any detection can reach."""
    try:
        return validate_true_effects(context, truth.effects, truth).nrmse
    except ValueError:
        return NAN


def validate_true_effects(context: Context, effects: Sequence[Effect], truth: Truth) -> Validation:
    """Validate a model with some of the true effects, as they were on the estimation run, fitted from the true values.

    Raises ValueError if the fit fails.
    """
    free, dataset = context.campaign.estimated_parameters, context.dataset
    nominal = context.nominal
    model = nominal.with_path_values(list(free), np.array([truth.values.get(p, nominal.value(p)) for p in free]))
    for e in effects:
        model = model.with_effect(PlacedEffect(e.kind, e.at, e.wheelset, dict(e.parameters)))
    fit = fit_output_error(
        context,
        model,
        [*free, *model.effect_paths()],
        segments=prepare_segments(context, model, dataset.estimation),
        stable=not model.limits_hunting,
        tolerance=1e-5,
    )
    return validate(context, fit.model, dataset.validation)


def _scores(row: TrialRow, case: PlantedCase, truth: Truth, result: LoopResult) -> str:
    """Errors of the estimates over their standard deviations, where the model has the planted effects and no others."""
    found = added_effects(result)
    if not row.right_name or len(found) != len(case.effects) or result.discrepancy is not None:
        return ""
    true = dict(truth.values)
    for group, effects in (("effects", result.after.model.design.effects), ("sensors", result.after.model.sensors)):
        for i, e in enumerate(effects):
            for p in case.effects:
                if (p.kind, p.at, p.wheelset) == (e.kind, e.at, e.wheelset):
                    true |= {f"{group}.{i}.{k}": v for k, v in p.parameters.items()}
    return " ".join(
        f"{path}={(x - true[path]) / sd:.3f}"
        for path, x, sd in zip(result.after.free.paths, result.after.x, result.after.sd, strict=True)
        if path in true and sd > 0
    )


def _repeat_without(row: TrialRow, case: PlantedCase, dataset: Dataset, result: LoopResult) -> TrialRow:
    """Repeat the loop with the planted effects and all indistinguishable ones excluded."""
    excluded = {kind for step in result.steps for kind in indistinguishable_kinds(result.context, step)} | {
        e.kind for e in case.effects
    }
    excluded |= {other for e in case.effects for other in _kinds() if is_same_family(e.kind, other)}
    repeated = close_loop(dataset, without=excluded, jobs=1)
    named = " + ".join(f"{e.kind} {e.at}" for e in added_effects(repeated))
    admits = repeated.verdict == "outside" or repeated.error_to_noise > UNEXPLAINED_RATIO or repeated.verdict == "none"
    ratio = f"{repeated.error_to_noise:.2f} of the floor"
    return replace(row, without=f"{repeated.verdict} {named} {ratio}".replace("  ", " "), admits=admits)


def _kinds() -> list[str]:
    return [str(r["kind"]) for r in core.effect_catalogue()]
