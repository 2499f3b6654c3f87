"""What was found held against what was planted: names, classes, places, oracle, coverage of intervals."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from railui import core
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.identification.estimation.multiple_shooting import limits_hunting
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import prepare_segments
from railui.identification.estimation.validation import Validation, validate
from railui.identification.loop import LoopResult, close_loop, indistinguishable_kinds
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.model import Model
from tests.blind.plants import Plant, alike
from tests.truth.campaign import Campaign
from tests.truth.effects import Effect
from tests.truth.files import paths

NAN = float("nan")
MATERIAL = 0.9  # oracle over before from which what was planted cannot lower the error by a tenth
ADEQUATE, CLEAN = 1.10, 1.5  # after over floor
NINETY = 1.6449  # standard deviations of a 90 % interval, to either side
BESIDE = {
    "contact": ("contact", "wheelset", "wheelset_yaw"),
    "wheelset": ("wheelset", "wheelset_yaw", "contact"),
    "frame": ("frame", "secondary_lateral"),
    "frame_yaw": ("frame_yaw", "secondary_yaw"),
}


@dataclass(frozen=True)
class Line:
    """One campaign of a trial: what was planted, what was found, whether that is right (None: does not apply)."""

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
    covered: int = 0  # true numbers inside their 90 % interval
    intervals: int = 0
    without: str = ""  # what is said with the answer and its look-alikes barred
    admits: bool | None = None  # and is that no clean effect?
    seconds: float = NAN
    cpu: float = NAN
    problem: str = ""

    @property
    def material(self) -> bool:
        """Does what was planted raise the error enough to change a verdict?"""
        best = self.oracle if self.oracle == self.oracle else self.floor
        return self.before * MATERIAL > best


def traced(plant: Plant, truth: Campaign, folder: Path, barred: bool = False) -> tuple[Line, LoopResult | None]:
    """The loop on a campaign of a trial; `barred`: once more with the answer taken away."""
    began, busy = time.perf_counter(), time.process_time()
    who = (plant.order.seed, plant.sort, plant.text, plant.nuisance)
    try:
        measurement = read_dataset(load_campaign(folder))
        found = close_loop(measurement, jobs=1)
        line = judged(plant, found)
        line = replace(line, seconds=time.perf_counter() - began, cpu=time.process_time() - busy)
        if plant.sort in ("catalogue", "two", "floor"):
            line = replace(line, oracle=oracle(plant, truth, measurement))
            line = _covered(line, plant, truth, found)
        if barred and line.right_class and plant.effects:
            line = _without(line, plant, measurement, found)
    except Exception as problem:
        text = f"{type(problem).__name__}: {problem}"
        return Line(*who, "exception", "", False, False, False, problem=text), None
    return line, found


def judged(plant: Plant, found: LoopResult) -> Line:
    """What was found held against what was planted."""
    named = [e for e in found.after.model.effects if e.kind != "measured_force"]
    words = [f"{e.kind} {e.at}{f' {e.wheelset}' if e.wheelset else ''}" for e in named]
    if found.outside:
        words.append(f"outside {found.outside.at}{f' {found.outside.wheelset}' if found.outside.wheelset else ''}")
    errors = {k: j.nrmse for k, j in found.validations.items()}
    name: bool | None
    kind: bool | None
    place: bool | None
    if plant.sort == "nothing":
        name = kind = place = found.verdict == "none"
    elif plant.sort == "outside":
        name, kind = None, found.verdict == "outside"
        at = found.outside.at if found.outside else ""
        place = at in BESIDE.get(plant.effects[0].at, (plant.effects[0].at,)) if at else None
    else:
        classes = [kinds for step in found.steps if (kinds := indistinguishable_kinds(step))]
        first = [{x for kinds in classes for x in kinds if e.kind in kinds} | {e.kind} for e in named]
        pairs = [[(e, more) for e, more in zip(named, first, strict=True) if e.at == p.at] for p in plant.effects]
        name = all(any(e.kind == p.kind for e, _ in near) for p, near in zip(plant.effects, pairs, strict=True))
        kind = all(
            any(p.kind in more or alike(p.kind, e.kind) for e, more in near)
            for p, near in zip(plant.effects, pairs, strict=True)
        )
        place = all(bool(near) for near in pairs)
    return Line(
        plant.order.seed, plant.sort, plant.text, plant.nuisance, found.verdict, " + ".join(words), name, kind, place,
        errors["declared"], errors["before"], errors["after"], found.floor.nrmse,
        best_rho2=found.steps[0].trace.rho2,
    )  # fmt: skip


def oracle(plant: Plant, truth: Campaign, measurement: Dataset) -> float:
    """The error of the true structure, adjusted from the true numbers: what no tracer can do better than."""
    try:
        return adjusted_truly(truth.effects["a"][: len(plant.effects)], truth, measurement).nrmse
    except ValueError:
        return NAN


def adjusted_truly(effects: Sequence[Effect], truth: Campaign, measurement: Dataset) -> Validation:
    """The judgement of a vehicle with some of the true effects, as they were on the adjusting run, with its phases.

    Adjusted from the true numbers. Raises ValueError where it cannot be.
    """
    free = measurement.campaign.adjust
    declared = Model(measurement.campaign.design, measurement.campaign.sensors)
    true = paths(truth.vehicle)
    model = declared.with_row(list(free), np.array([true[p] for p in free]))
    for e in effects:
        model = model.with_effect(PlacedEffect(e.kind, e.at, e.wheelset, dict(e.parameters)))
    fit = fit_output_error(
        model, measurement, [*free, *model.effect_paths()], declared,
        ready=prepare_segments(model, measurement, measurement.estimation), stable=not limits_hunting(model), tolerance=1e-5, jobs=1,
    )  # fmt: skip
    return validate(fit.model, measurement, measurement.validation)


def _covered(line: Line, plant: Plant, truth: Campaign, found: LoopResult) -> Line:
    """How many 90 % intervals hold the true number, where the names are right."""
    if not line.right_name or found.verdict != "effect":
        return line
    true = dict(paths(truth.vehicle))
    for group, effects in (("effects", found.after.model.design.effects), ("sensors", found.after.model.sensors)):
        for i, e in enumerate(effects):
            for p in plant.effects:
                if (p.kind, p.at, p.wheelset) == (e.kind, e.at, e.wheelset):
                    true |= {f"{group}.{i}.{k}": v for k, v in p.parameters.items()}
    inside = [
        abs(x - true[path]) <= NINETY * sd
        for path, x, sd in zip(found.after.free.paths, found.after.x, found.after.sd, strict=True)
        if path in true and sd > 0
    ]
    return replace(line, covered=int(sum(inside)), intervals=len(inside))


def _without(line: Line, plant: Plant, measurement: Dataset, found: LoopResult) -> Line:
    """The loop once more with what was planted and all its look-alikes barred."""
    barred = {kind for step in found.steps for kind in indistinguishable_kinds(step)} | {e.kind for e in plant.effects}
    barred |= {other for e in plant.effects for other in _kinds() if alike(e.kind, other)}
    again = close_loop(measurement, without=barred, jobs=1)
    named = " + ".join(f"{e.kind} {e.at}" for e in again.after.model.effects if e.kind != "measured_force")
    admits = again.verdict == "outside" or again.unexplained > CLEAN or again.verdict == "none"
    ratio = f"{again.unexplained:.2f} of the floor"
    return replace(line, without=f"{again.verdict} {named} {ratio}".replace("  ", " "), admits=admits)


def _kinds() -> list[str]:
    return [str(r["kind"]) for r in core.catalogue()]
