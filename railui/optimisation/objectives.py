"""Objectives and constraints of designs over all cases of a study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.io.number_format import format_quantity
from railui.io.problems import Findings
from railui.io.yaml_document import load_yaml
from railui.optimisation.cases import Case, case_too_short_for_n_mv
from railui.optimisation.evaluation import Evaluator, ResponseTable, response_table
from railui.optimisation.response_keys import RESPONSE_KEYS
from railui.optimisation.scenarios import FRICTION_PATH, friction_paths
from railui.optimisation.study import Constraint, Objective, Study

PENALTY: Final = 1e9  # replaces infinite objectives and violations within the search
BOUND_TOLERANCE: Final = 0.01  # share of a range: an optimum closer to a bound counts as at the bound
PRIMARY_STIFFNESSES: Final = ("vehicle.primary.lateral_stiffness", "vehicle.primary.longitudinal_stiffness")


@dataclass(frozen=True, eq=False)
class Assessment:
    """Objectives and constraints of n designs over all cases.

    Attributes
    ----------
    objectives : float [n, objective]
        Aggregated over the cases; infinite, with the bad sign, for a design that failed in any case.
    constraints : float [n, constraint]
        Value of the constrained key in the worst case.
    distance_share : float [n]
        Least completed share of the track over the cases; 1 unless the design failed.
    reasons : list of str [n]
        Reason of failure; empty for a design that did not fail.
    """

    objectives: FloatArray
    constraints: FloatArray
    distance_share: FloatArray
    reasons: list[str]

    def __len__(self) -> int:
        return len(self.distance_share)

    def select(self, order: NDArray[np.int64]) -> Assessment:
        """Return the assessment of the designs with these indices."""
        reasons = [self.reasons[i] for i in order]
        return Assessment(self.objectives[order], self.constraints[order], self.distance_share[order], reasons)

    def followed_by(self, other: Assessment) -> Assessment:
        """Return the assessment of these designs and, after them, of others."""
        return Assessment(
            np.vstack([self.objectives, other.objectives]),
            np.vstack([self.constraints, other.constraints]),
            np.concatenate([self.distance_share, other.distance_share]),
            [*self.reasons, *other.reasons],
        )


def required_keys(study: Study) -> list[str]:
    """Return the keys of the objectives and constraints of a study, sorted, each once."""
    return sorted({*(item.key for item in study.objectives), *(item.key for item in study.constraints)})


def assess(study: Study, cases: Sequence[Case], x: FloatArray, evaluator: Evaluator) -> Assessment:
    """Evaluate designs x [n, variable] on cases and return their objectives and constraints."""
    return assess_responses(study, response_table(cases, x, required_keys(study), evaluator))


def assess_responses(study: Study, table: ResponseTable) -> Assessment:
    """Return the objectives and constraints of designs from their responses on all cases."""
    objectives = [
        np.where(table.failed, np.inf * objective_sign(objective), aggregate(table.values[objective.key], objective))
        for objective in study.objectives
    ]
    worst = {">=": np.min, "<=": np.max}
    constraints = [worst[item.relation](table.values[item.key], axis=1) for item in study.constraints]
    reasons = [next(filter(None, case_reasons), "") for case_reasons in table.reasons]
    return Assessment(
        objectives=np.stack(objectives, axis=1),
        constraints=np.array(constraints).reshape(len(constraints), len(table.distance_share)).T,
        distance_share=table.distance_share.min(axis=1),
        reasons=reasons,
    )


def objective_sign(objective: Objective) -> float:
    """Return 1 for an objective to minimise, -1 for one to maximise."""
    return 1.0 if objective.sense == "minimise" else -1.0


def aggregate(values: FloatArray, objective: Objective) -> FloatArray:
    """Return the mean, the worst or the 95th percentile towards the bad side, [n], of values [n, case].

    >>> aggregate(np.array([[1.0, 2.0, 6.0]]), Objective("flange_margin", "maximise", "worst"))
    array([1.])
    """
    minimised = objective_sign(objective) * values
    if objective.over == "worst":
        result = minimised.max(axis=1)
    elif objective.over == "mean":
        result = minimised.mean(axis=1)
    else:
        with np.errstate(invalid="ignore"):  # infinite where a design failed
            result = np.asarray(np.percentile(minimised, 95, axis=1))
    return np.asarray(objective_sign(objective) * result)


def finite_or_none(values: FloatArray) -> list[float | None]:
    """Return numbers as a list, with None in place of those that are not finite."""
    return [float(value) if np.isfinite(value) else None for value in values]


def violations(study: Study, assessment: Assessment) -> FloatArray:
    """Return the relative violations [n, constraint + 1] of the constraints; a constraint is met at 0 or less.

    The last column is the failure: -1 for none, else the larger the sooner the design failed, so that a search is
    led out of a region where every design fails.
    """
    columns = [
        _relative_violation(constraint, values)
        for constraint, values in zip(study.constraints, assessment.constraints.T, strict=True)
    ]
    failure = np.where(assessment.distance_share < 1, 2 - assessment.distance_share, -1.0)
    stacked = np.nan_to_num(np.stack([*columns, failure], axis=1), nan=PENALTY)
    return np.asarray(np.clip(stacked, -PENALTY, PENALTY))


def _relative_violation(constraint: Constraint, values: FloatArray) -> FloatArray:
    excess = constraint.bound - values if constraint.relation == ">=" else values - constraint.bound
    return excess / (abs(constraint.bound) or 1.0)


def check_objectives(study: Study, cases: Sequence[Case] = ()) -> None:
    """Check that the objectives can be evaluated on the cases and that the variables may vary.

    Raises FileProblems with every fault.
    """
    findings = load_yaml(study.source).findings()
    for i, objective in enumerate(study.objectives):
        _check_duration(objective.key, f"objectives.{i}.{objective.sense}", cases, findings)
    for i, constraint in enumerate(study.constraints):
        _check_duration(constraint.key, f"constraints.{i}", cases, findings)
    for variable in study.variables:
        _check_variable(study, variable.path, findings)
    findings.raise_errors()


def _check_variable(study: Study, path: str, findings: Findings) -> None:
    key = f"variables.{path}"
    if path.startswith("riding."):
        what = "is a criterion of the assessment, not a part of the design"
        findings.add(key, what, "set it in the design, or in a scenario", key=True)
    names = {path, FRICTION_PATH} if path in friction_paths(study.design) else {path}
    if any(not names.isdisjoint(scenario) for scenario in study.cases.scenario):
        findings.add(key, "is a variable and also set in a scenario", "leave it out of one of them", key=True)


def _check_duration(name: str, key: str, cases: Sequence[Case], findings: Findings) -> None:
    if name == "n_mv" and (case := case_too_short_for_n_mv(cases)) is not None:
        excitation = case.excitation
        length = 300 * excitation.speed
        duration = f"{excitation.source.name} at {excitation.speed:.4g} m/s lasts {excitation.duration:.4g} s"
        findings.add(key, f"n_mv needs 300 s, {duration}", f"use a track of {length:.6g} m")


def is_at_bound(share: float, *ends: float) -> bool:
    """Return True for a value, given as a share of its range from 0 to 1, at one of the ends (any by default).

    >>> is_at_bound(0.995), is_at_bound(0.995, 0.0), is_at_bound(0.5)
    (True, False, False)
    """
    return any(abs(share - end) < BOUND_TOLERANCE for end in ends or (0.0, 1.0))


def result_warnings(study: Study, unit: FloatArray, knee: int | None) -> list[str]:
    """Return the warnings for the reader of a result; unit [n, variable] is the front in the unit cube."""
    warnings = [] if knee is None else _bound_warnings(study, unit[knee])
    analyses = {RESPONSE_KEYS[key].analysis for key in required_keys(study)}
    stiffnesses = [variable.path for variable in study.variables if variable.path in PRIMARY_STIFFNESSES]
    if stiffnesses and "curve" not in analyses:
        what = "no objective or constraint evaluates a curve: what is optimal on straight track may cause"
        warnings.append(f"{' and '.join(stiffnesses)} varied, and {what} high guiding forces and wear in curves")
    if study.cases.draws and study.design.adjustment is not None:
        what = "samples of the calibrated parameters, the calibrated values not among them"
        warnings.append(f"{study.cases.draws} {what}")
    return warnings


def _bound_warnings(study: Study, knee: FloatArray) -> list[str]:
    """Return a warning for every variable of which the knee, a point [variable] of the unit cube, is at a bound."""
    warnings = []
    for share, variable in zip(knee, study.variables, strict=True):
        for word, end, bound in (("lower", 0.0, variable.lowest), ("upper", 1.0, variable.highest)):
            if is_at_bound(float(share), end):
                where = f"the {word} bound of {variable.path}, {format_quantity(bound, variable.unit)}"
                warnings.append(f"the knee is at {where}: the optimum may lie beyond it")
    return warnings
