"""The search for better suspensions: a study searched, its front evaluated again, before and after compared."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.optimisation.cases import Case, cases_of
from railui.optimisation.design_space import Generation, Judge, Ranges, first_generation, relative_to
from railui.optimisation.evaluation import Evaluator, evaluate_in_process, response_table
from railui.optimisation.multi_objective import hypervolumes, knee, search_pymoo
from railui.optimisation.objectives import (
    Assessed,
    assess,
    assess_by,
    check_objectives,
    keys_of,
    sign,
    violations,
    warnings_for,
)
from railui.optimisation.responses import steppable
from railui.optimisation.sensitivity import one_at_a_time, sobol
from railui.optimisation.single_objective import polish, search_cmaes
from railui.optimisation.study import Study, load_study
from railui.progress import Report, silent
from railui.ride_quality.evaluation import quality_of
from railui.ride_quality.score import CLASSES
from railui.ride_quality.statistics import statistics_many
from railui.track import parse_spec

FRESH: Final = 8  # sets of seeds on which the front is evaluated again
COMPARED: Final = (
    *("score", "comfort_hours", "weighted_acceleration", "weighted_acceleration_1974", "wz"),
    *("flange_fraction", "flange_fraction_gaussian", "flange_margin"),
)


@dataclass
class SearchState:
    """Where a search stands: designs evaluated, failed (by reason), what is going on in words.

    `latest` is the generation tried last, `baseline` the judged vehicle as it is.
    """

    evaluations: int = 0
    failures: Counter[str] = field(default_factory=Counter)
    doing: str = ""
    latest: Generation | None = field(default=None, repr=False)
    baseline: Assessed | None = field(default=None, repr=False)

    @property
    def failed(self) -> int:
        """Designs that failed in any case."""
        return self.failures.total()


def unseen(_: SearchState) -> None:
    """Looks at nothing."""


def optimise(
    study: Study | str | Path,
    *,
    seed: int | None = None,
    jobs: int | None = None,
    report: Report = silent,
    evaluator: Evaluator | None = None,
    watch: Callable[[SearchState], None] = unseen,
    samples: int = 0,
) -> dict[str, Any]:
    """Searches the variables of a study (or its file) for better designs; finite values or None.

    `pareto`: the front, the first aim's best first; `baseline`: the vehicle as it is; each with variables,
    objectives, constraints (of the worst case) and fresh (mean and sd of the objectives over 8 sets of seeds
    that the search never saw). `knee`: the index of the front's knee. `evaluations`, `failed` (designs that
    left the track or cannot be stepped), `failures` by reason, `hypervolume` after every generation, `riding`
    before and after, `sensitivities` of the knee (of the vehicle as it is where there is none) to every number
    alone and, with `samples`, Sobol's over the ranges, `warnings`. Where no design keeps the limits pareto is
    empty, knee None and `closest` the nearest. `seed` takes the place of the method's; `evaluator` answers
    instead of this process and `jobs`; `report` and `watch` are told every generation. Raises FileProblems for
    a study that asks for what there is not.
    """
    begun = time.perf_counter()
    study = load_study(study, check_track=parse_spec) if isinstance(study, str | Path) else study
    if seed is not None:
        study = replace(study, method=replace(study.method, seed=seed))
    cases = checked_cases(study)
    ask = evaluator or evaluate_in_process(jobs)
    declared = declared_values(study)
    search = _Search(study, lambda x: assess(study, cases, x, ask), report, watch)
    baseline = search.stand.baseline = search.judge(declared[None])
    front = search.run(declared)

    found, last = _front(study, front, search.judge)
    search.say(f"evaluating {len(found) + 1} designs again on {FRESH} sets of fresh seeds")
    fresh = fresh_objectives(study, np.vstack([declared, found]), ask)
    best = knee(last.objectives, np.array([sign(aim) for aim in study.objectives])) if len(found) else None
    search.say("asking what the result hangs on")
    at = declared if best is None else found[best]
    sensitivities = {
        "one_at_a_time": one_at_a_time(study, cases, at, ask),
        "sobol": sobol(study, cases, ask, samples) if samples else None,
    }
    riding = quality(cases, declared if best is None else np.stack([declared, found[best]]), jobs)
    return {
        "study": study.name,
        "aims": [{"key": aim.key, "sense": aim.sense, "over": aim.over} for aim in study.objectives],
        "limits": [limit.text for limit in study.constraints],
        "method": vars(study.method),
        "cases": len(cases),
        "pareto": [_point(study, x, last, i, fresh[:, 1 + i]) for i, x in enumerate(found)],
        "baseline": _point(study, declared, baseline, 0, fresh[:, 0]),
        "knee": best,
        "closest": _named(study, search.nearest) if best is None else None,
        "evaluations": search.stand.evaluations,
        "failed": search.stand.failed,
        "failures": dict(sorted(search.stand.failures.items())),
        "hypervolume": hypervolumes(search.history),
        "riding": {"before": riding[0], "after": None if best is None else riding[1]},
        "sensitivities": sensitivities,
        "warnings": warnings_for(study, Ranges(study.variables).unit(found), best),
        "seconds": time.perf_counter() - begun,
    }


def checked_cases(study: Study) -> list[Case]:
    """The cases of a study that can be searched; FileProblems where it asks for what there is not."""
    check_objectives(study)
    cases = cases_of(study)
    check_objectives(study, cases)
    return cases


def declared_values(study: Study) -> FloatArray:
    """The variables [variable] of the vehicle as it is."""
    return np.array([study.design.value(variable.path) for variable in study.variables])


class _Search:
    """A search under way: its stand, the front so far, the design nearest to the limits, the fronts there were."""

    def __init__(self, study: Study, judge: Judge, report: Report, watch: Callable[[SearchState], None]):
        self.study, self.judge, self.report, self.watch = study, judge, report, watch
        self.stand, self.least, self.nearest = SearchState(), np.inf, declared_values(study)
        self.history: list[tuple[int, FloatArray]] = []

    def say(self, text: str) -> None:
        """Tells what is going on."""
        self.stand.doing = text
        self.report(text)
        self.watch(self.stand)

    def run(self, declared: FloatArray) -> FloatArray:
        """Searches by the study's method, then polishes where there is one aim; values [n, variable] of the front."""
        study, method = self.study, self.study.method
        first = first_generation(Ranges(study.variables), method.population, declared, method.seed)
        by = search_cmaes if method.kind == "cmaes" else search_pymoo
        front = self._walk(by(study, first, self.judge), f"generation {{}} of {method.generations}", declared[None])
        if len(study.objectives) == 1:
            front = self._walk(polish(study, front[0], self.judge), "polish {}", front)
        return front if self.least == 0 else front[:0]

    def _walk(self, steps: Iterator[Generation], words: str, front: FloatArray) -> FloatArray:
        for number, one in enumerate(steps, 1):
            front = one.front
            self._count(one)
            kept = f"{len(front)} on the front" if self.least == 0 else "none keeps the limits yet"
            told = f"{self.stand.evaluations} designs, {self.stand.failed} failed, {kept}"
            self.say(f"{words.format(number)}: {told}")
        return front

    def _count(self, one: Generation) -> None:
        self.stand.evaluations += len(one.x)
        self.stand.latest = one
        self.stand.failures.update(reason for reason in one.judged.reasons if reason)
        beyond = np.maximum(violations(self.study, one.judged), 0).sum(axis=1)
        if beyond.min() < self.least:
            self.least, self.nearest = float(beyond.min()), one.x[int(np.argmin(beyond))]
        self.history.append((self.stand.evaluations, relative_to(self.study, one.judged)[beyond == 0]))


def _front(study: Study, front: FloatArray, judge: Judge) -> tuple[FloatArray, Assessed]:
    """The front [n, variable], each design once, the first aim's best first, and how it is judged."""
    if not len(front):
        objectives, limits = (np.zeros((0, len(each))) for each in (study.objectives, study.constraints))
        return front, Assessed(objectives, limits, front[:, 0], [])
    found = np.unique(front, axis=0)
    judged = judge(found)
    order = np.argsort(sign(study.objectives[0]) * judged.objectives[:, 0], kind="stable")
    return found[order], judged.select(order)


def fresh_objectives(study: Study, x: FloatArray, evaluator: Evaluator) -> FloatArray:
    """Objectives [set, design, aim] of designs x [design, variable] on seeds that the study does not use.

    NaN where every track is a file, which has no seeds.
    """
    found = np.full((FRESH, len(x), len(study.objectives)), np.nan)
    sets = [cases_of(study, fresh=k) for k in range(FRESH)]
    if all(case.road.laid.seed is None for case in sets[0]):
        return found
    # all sets at once, so that threads and machines have enough to do
    numbers = response_table(list(chain(*sets)), x, keys_of(study), evaluator)
    each = len(sets[0])
    for k in range(FRESH):
        found[k] = assess_by(study, numbers.of_cases(slice(k * each, (k + 1) * each))).objectives
    return found


def quality(cases: Sequence[Case], x: FloatArray, jobs: int | None = None) -> list[dict[str, Any] | None]:
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


def _named(study: Study, x: FloatArray) -> dict[str, float]:
    return {variable.path: float(value) for variable, value in zip(study.variables, x, strict=True)}


def _point(study: Study, x: FloatArray, judged: Assessed, i: int, fresh: FloatArray) -> dict[str, Any]:
    """One design of the result; fresh [set, aim]."""
    with np.errstate(invalid="ignore"):
        mean, sd = fresh.mean(axis=0), fresh.std(axis=0, ddof=1)
    return {
        "variables": _named(study, x),
        "objectives": _finite(judged.objectives[i]),
        "constraints": _finite(judged.constraints[i]),
        "fresh": {"mean": _finite(mean), "sd": _finite(sd)},
    }


def _finite(values: FloatArray) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]
