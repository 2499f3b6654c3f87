"""The search for better suspensions: a study searched, its front ridden again, before and after compared."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from railui.files.design import Design
from railui.files.study import Study, load_study
from railui.study.aims import Judged, check_aims, evaluate, remarks, sign, violations
from railui.study.cases import Case, cases_of, steppable
from railui.study.ride import quality_of, statistics_many
from railui.study.score import CLASSES
from railui.study.search import Ranges, generations, knee
from railui.track import parse_spec

Floats = NDArray[np.float64]
Report = Callable[[str], None]

FRESH: Final = 8  # sets of seeds on which the front is ridden again
COMPARED: Final = (
    *("score", "comfort_hours", "weighted_acceleration", "weighted_acceleration_1974", "wz"),
    *("flange_fraction", "flange_fraction_gaussian", "flange_margin"),
)


def silent(_: str) -> None:
    """Reports nothing."""


def optimise(
    study: Study | str | Path, *, seed: int | None = None, jobs: int | None = None, report: Report = silent
) -> dict[str, Any]:
    """Searches the variables of a study (or its file) for better designs; finite values or None.

    `pareto`: the front, the first aim's best first; `baseline`: the vehicle as it is; each with variables,
    objectives, constraints (of the worst case) and fresh (mean and sd of the objectives over 8 sets of seeds
    that the search never saw). `knee`: the index of the front's knee. `evaluations`, `failed` (designs that
    left the track or cannot be stepped), `riding` before and after, `warnings`. Where no design keeps the
    limits pareto is empty, knee None and `closest` the nearest. `seed` takes the place of the method's;
    `report` is told every generation. Raises FileProblems for a study that asks for what there is not.
    """
    begun = time.perf_counter()
    study = load_study(study, check_track=parse_spec) if isinstance(study, str | Path) else study
    seed = study.method.seed if seed is None else seed
    check_aims(study)
    cases = cases_of(study, seed=seed)
    check_aims(study, cases)
    declared = np.array([study.design.value(variable.path) for variable in study.variables])
    baseline = evaluate(study, cases, declared[None], jobs)

    evaluations, failed, front = 0, 0, declared[None]
    least, nearest = np.inf, declared
    steps = generations(study, declared, seed, lambda x: evaluate(study, cases, x, jobs))
    for number, (x, judged, front) in enumerate(steps, 1):
        evaluations += len(x)
        failed += int(np.sum(judged.travelled < 1))
        beyond = np.maximum(violations(study, judged), 0).sum(axis=1)
        if beyond.min() < least:
            least, nearest = float(beyond.min()), x[int(np.argmin(beyond))]
        kept = f"{len(front)} on the front" if least == 0 else "none keeps the limits yet"
        told = f"{evaluations} designs, {failed} failed, {kept}"
        report(f"generation {number} of {study.method.generations}: {told}")

    found, last = _front(study, cases, front if least == 0 else front[:0], jobs)
    report(f"riding {len(found) + 1} designs again on {FRESH} sets of fresh seeds")
    fresh = fresh_objectives(study, np.vstack([declared, found]), seed, jobs)
    best = knee(last.objectives, np.array([sign(aim) for aim in study.objectives])) if len(found) else None
    riding = quality(cases, declared if best is None else np.stack([declared, found[best]]), jobs)
    return {
        "study": study.name,
        "aims": [{"key": aim.key, "sense": aim.sense, "over": aim.over} for aim in study.objectives],
        "limits": [limit.text for limit in study.constraints],
        "cases": len(cases),
        "pareto": [_point(study, x, last, i, fresh[:, 1 + i]) for i, x in enumerate(found)],
        "baseline": _point(study, declared, baseline, 0, fresh[:, 0]),
        "knee": best,
        "closest": _named(study, nearest) if best is None else None,
        "evaluations": evaluations,
        "failed": failed,
        "riding": {"before": riding[0], "after": None if best is None else riding[1]},
        "warnings": remarks(study, Ranges(study.variables).unit(found), best),
        "seconds": time.perf_counter() - begun,
    }


def _front(study: Study, cases: Sequence[Case], front: Floats, jobs: int | None) -> tuple[Floats, Judged]:
    """The front [n, variable], each design once, the first aim's best first, and how it is judged."""
    if not len(front):
        return front, Judged(np.zeros((0, len(study.objectives))), np.zeros((0, len(study.constraints))), front[:, 0])
    found = np.unique(front, axis=0)
    judged = evaluate(study, cases, found, jobs)
    order = np.argsort(sign(study.objectives[0]) * judged.objectives[:, 0], kind="stable")
    return found[order], judged.select(order)


def fresh_objectives(study: Study, x: Floats, seed: int, jobs: int | None) -> Floats:
    """Objectives [set, design, aim] of designs x [design, variable] on seeds that the study does not use.

    NaN where every track is a file, which has no seeds.
    """
    found = np.full((FRESH, len(x), len(study.objectives)), np.nan)
    for k in range(FRESH):
        cases = cases_of(study, fresh=k, seed=seed)
        if all(case.road.laid.seed is None for case in cases):
            break
        found[k] = evaluate(study, cases, x, jobs).objectives
    return found


def quality(cases: Sequence[Case], x: Floats, jobs: int | None = None) -> list[dict[str, Any] | None]:
    """The riding quality of designs x [n, variable], means over the cases and the worst class.

    None for a design that is too stiff to be stepped in any case.
    """
    ridden: list[list[dict[str, Any]]] = [[] for _ in np.atleast_2d(x)]
    for case in cases:
        model, rows = case.vehicle.model, case.vehicle.rows(np.atleast_2d(x))
        able, steps = steppable(model, rows, case.road)
        statistics = statistics_many(model, rows[able], case.road, steps=steps, jobs=jobs) if len(able) else {}
        for k, i in enumerate(able):
            ridden[i].append(quality_of(model, statistics, k, case.road))
    return [_mean_quality(one) if len(one) == len(cases) else None for one in ridden]


def _mean_quality(rides: list[dict[str, Any]]) -> dict[str, Any]:
    worst = min(rides, key=lambda one: CLASSES.index(one["class"]))
    means = {
        key: None if any(one[key] is None for one in rides) else float(np.mean([one[key] for one in rides]))
        for key in COMPARED
    }
    return {"class": worst["class"], "decided_by": worst["decided_by"], **means}


def _named(study: Study, x: Floats) -> dict[str, float]:
    return {variable.path: float(value) for variable, value in zip(study.variables, x, strict=True)}


def _point(study: Study, x: Floats, judged: Judged, i: int, fresh: Floats) -> dict[str, Any]:
    """One design of the result; fresh [set, aim]."""
    with np.errstate(invalid="ignore"):
        mean, sd = fresh.mean(axis=0), fresh.std(axis=0, ddof=1)
    return {
        "variables": _named(study, x),
        "objectives": _finite(judged.objectives[i]),
        "constraints": _finite(judged.constraints[i]),
        "fresh": {"mean": _finite(mean), "sd": _finite(sd)},
    }


def _finite(values: Floats) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]


def knee_design(study: Study, result: dict[str, Any]) -> Design | None:
    """The design at the knee of a result of this study, None where there is none."""
    if result["knee"] is None:
        return None
    design = study.design.with_values(result["pareto"][result["knee"]]["variables"])
    return replace(design, name=f"{study.name}, knee")
