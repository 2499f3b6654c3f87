"""What a study aims at: objectives and limits of designs over all cases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.io.number_format import display
from railui.io.problems import Findings
from railui.io.yaml_document import load
from railui.optimisation.cases import Case, too_short
from railui.optimisation.evaluation import Evaluator, ResponseTable, response_table
from railui.optimisation.response_keys import RESULTS
from railui.optimisation.study import Constraint, Objective, Study

BAD: Final = 1e9  # what stands for infinite in the search's own arithmetic
EDGE: Final = 0.01  # share of a range from a bound within which an optimum stands on it
STIFFNESSES: Final = ("vehicle.primary.lateral_stiffness", "vehicle.primary.longitudinal_stiffness")


@dataclass(frozen=True, eq=False)
class Assessed:
    """Designs judged on all cases: objectives [n, aim], constraints [n, limit] of the worst case, by their keys.

    travelled [n]: the least share of the way, 1 all of it; reasons [n]: why a design failed, else empty. A
    design that failed in any case has infinite objectives of the bad sign.
    """

    objectives: FloatArray
    constraints: FloatArray
    travelled: FloatArray
    reasons: list[str]

    def __len__(self) -> int:
        return len(self.travelled)

    def select(self, order: NDArray[np.int64]) -> Assessed:
        """Some of the designs."""
        reasons = [self.reasons[i] for i in order]
        return Assessed(self.objectives[order], self.constraints[order], self.travelled[order], reasons)


def keys_of(study: Study) -> list[str]:
    """The keys of the results that a study aims at or limits, each once."""
    return sorted({*(aim.key for aim in study.objectives), *(limit.key for limit in study.constraints)})


def assess(study: Study, cases: Sequence[Case], x: FloatArray, evaluator: Evaluator) -> Assessed:
    """Designs with values x [n, variable] of a study, judged on cases: all that a search asks for."""
    return assess_by(study, response_table(cases, x, keys_of(study), evaluator))


def assess_by(study: Study, numbers: ResponseTable) -> Assessed:
    """The aims and limits of designs from their numbers on all cases."""
    objectives = [
        np.where(numbers.failed, np.inf * sign(aim), aggregate(numbers.values[aim.key], aim))
        for aim in study.objectives
    ]
    worst = {">=": np.min, "<=": np.max}
    limits = [worst[limit.relation](numbers.values[limit.key], axis=1) for limit in study.constraints]
    held = np.array(limits).reshape(len(limits), len(numbers.travelled)).T
    reasons = [next(filter(None, one), "") for one in numbers.reasons]
    return Assessed(np.stack(objectives, axis=1), held, numbers.travelled.min(axis=1), reasons)


def sign(objective: Objective) -> float:
    """1 where less is better, -1 where more is."""
    return 1.0 if objective.sense == "minimise" else -1.0


def aggregate(values: FloatArray, objective: Objective) -> FloatArray:
    """One value [n] of values [n, case]: their mean, the worst, or what 95 % of the cases keep.

    >>> aggregate(np.array([[1.0, 2.0, 6.0]]), Objective("flange_margin", "maximise", "worst"))
    array([1.])
    """
    against = sign(objective) * values
    if objective.over == "worst":
        found = against.max(axis=1)
    elif objective.over == "mean":
        found = against.mean(axis=1)
    else:
        with np.errstate(invalid="ignore"):  # infinite where a design failed
            found = np.asarray(np.percentile(against, 95, axis=1))
    return np.asarray(sign(objective) * found)


def violations(study: Study, judged: Assessed) -> FloatArray:
    """By what share each limit is exceeded, 0 or less where it is kept, [n, limit + 1]; the last: failures."""
    columns = [_over(limit, values) for limit, values in zip(study.constraints, judged.constraints.T, strict=True)]
    # the sooner a design fails the worse, which shows the search a way out
    failed = np.where(judged.travelled < 1, 2 - judged.travelled, -1.0)
    return np.asarray(np.clip(np.nan_to_num(np.stack([*columns, failed], axis=1), nan=BAD), -BAD, BAD))


def _over(limit: Constraint, values: FloatArray) -> FloatArray:
    over = limit.bound - values if limit.relation == ">=" else values - limit.bound
    return over / (abs(limit.bound) or 1.0)


def check_objectives(study: Study, cases: Sequence[Case] = ()) -> None:
    """FileProblems for aims that no result answers yet, and for variables that are none."""
    findings = load(study.source).findings()
    for i, objective in enumerate(study.objectives):
        _check_key(objective.key, f"objectives.{i}.{objective.sense}", list(cases), findings)
    for i, limit in enumerate(study.constraints):
        _check_key(limit.key, f"constraints.{i}", list(cases), findings)
    for variable in study.variables:
        where = f"variables.{variable.path}"
        if variable.path.startswith("riding."):
            what = "is what a design is judged by, not a part of it"
            findings.add(where, what, "set it in the design, or in a scenario", key=True)
        if any(variable.path in scenario for scenario in study.cases.scenario):
            what = "is a variable and stands in a scenario"
            findings.add(where, what, "leave it out of one of them", key=True)
    findings.stop()


def _check_key(key: str, where: str, cases: list[Case], findings: Findings) -> None:
    if key == "n_mv" and (short := too_short(cases)) is not None:
        length = 300 * short.road.speed
        what = f"n_mv needs 300 s, {short.road.laid.name} at {short.road.speed:g} m/s lasts {short.road.duration:.4g} s"
        findings.add(where, what, f"take a track of {length:.6g} m")


def on_edge(share: float, *ends: float) -> bool:
    """Does a value at a share of its range, 0 to 1, stand on one of some ends, on any where none is named?

    >>> on_edge(0.995), on_edge(0.995, 0.0), on_edge(0.5)
    (True, False, False)
    """
    return any(abs(share - end) < EDGE for end in ends or (0.0, 1.0))


def warnings_for(study: Study, unit: FloatArray, knee: int | None) -> list[str]:
    """What a reader of the result must know; unit [n, variable]: the front in the unit cube of the ranges."""
    found = []
    for j, variable in enumerate(study.variables):
        ends = [(v, w) for v, w in ((variable.lowest, 0.0), (variable.highest, 1.0))]
        for bound, end in ends if knee is not None else []:
            if on_edge(float(unit[knee, j]), end):
                word = "lower" if end == 0 else "upper"
                text = f"the knee stands on the {word} bound of {variable.path}, {display(bound, variable.unit)}"
                found.append(f"{text}: the optimum may lie beyond it")
    keys = {*(aim.key for aim in study.objectives), *(limit.key for limit in study.constraints)}
    questions = {RESULTS[key].question for key in keys}
    stiff = [variable.path for variable in study.variables if variable.path in STIFFNESSES]
    if stiff and "curve" not in questions:
        told = "no aim or limit looks at a curve: what rides well on straight track may eat rails in curves"
        found.append(f"{' and '.join(stiff)} varied, and {told}")
    if study.cases.draws and study.design.adjustment is not None:
        found.append(f"{study.cases.draws} draws from the adjustment's covariance, the adjusted values not among them")
    return found
