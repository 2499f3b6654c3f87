"""Evaluation of designs again, on sets of seeds that the search did not use: spread, differences, constraints."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from railui.arrays import FloatArray
from railui.optimisation.cases import cases_of, has_seeds
from railui.optimisation.evaluation import Evaluator, response_table
from railui.optimisation.objectives import Assessment, assess_responses, finite_or_none, required_keys, violations
from railui.optimisation.study import Study

FRESH_SEED_SETS: Final = 8  # on which the front is evaluated again
SIGNIFICANCE: Final = 0.05  # probability of a difference by chance below which it counts as significant
ROUNDING: Final = 1e-12  # share of an objective below which its differences are of rounding
Difference = dict[str, list[float | None]]


@dataclass(frozen=True, eq=False)
class FreshResponses:
    """Assessments of the same designs on sets of fresh seeds; no sets if no case has a seed."""

    study: Study
    sets: Sequence[Assessment]

    @cached_property
    def objectives(self) -> FloatArray:
        """Objectives [set, design, objective]."""
        return np.stack([one.objectives for one in self.sets])

    @cached_property
    def constraints(self) -> FloatArray:
        """Values of the constrained keys in the worst case [set, design, constraint]."""
        return np.stack([one.constraints for one in self.sets])

    @cached_property
    def is_met(self) -> NDArray[np.bool_]:
        """True where a design meets a constraint [set, design, constraint]; False where it failed."""
        return np.stack([(violations(self.study, one) <= 0)[:, :-1] & ~_failed(one)[:, None] for one in self.sets])

    def summary(self, design: int, baseline: int, knee: int | None) -> dict[str, Any]:
        """Return the key `fresh` of a design; baseline and knee are numbers of designs."""
        if not self.sets:
            return self._empty_summary()
        objectives = self.objectives
        own = objectives[:, design]
        with np.errstate(invalid="ignore"):  # infinite where a design failed
            mean, sd = own.mean(axis=0), _standard_deviation(own, own)
        reasons = Counter(one.reasons[design] for one in self.sets if _failed(one)[design])
        return {
            "mean": finite_or_none(mean),
            "sd": finite_or_none(sd),
            "sets": len(self.sets),
            "failed": sum(reasons.values()),
            "failures": dict(sorted(reasons.items())),
            "constraints": finite_or_none(self._worst_constraints(design)),
            "met": self.is_met[:, design].sum(axis=0).tolist(),
            "minus_baseline": paired_difference(objectives, design, baseline),
            "minus_knee": paired_difference(objectives, design, knee),
        }

    def _empty_summary(self) -> dict[str, Any]:
        """Return the key `fresh` of a design without fresh seeds."""
        items = self.study.objectives, self.study.constraints
        no_objectives, no_constraints = ([None] * len(each) for each in items)
        no_difference = dict.fromkeys(("mean", "standard_error", "p_value"), no_objectives)
        return {
            "mean": no_objectives,
            "sd": no_objectives,
            "sets": 0,
            "failed": None,
            "failures": {},
            "constraints": no_constraints,
            "met": no_constraints,
            "minus_baseline": no_difference,
            "minus_knee": no_difference,
        }

    def _worst_constraints(self, design: int) -> FloatArray:
        """Return the value [constraint] of every constrained key in the worst case of all sets."""
        values = self.constraints[:, design]
        at_least = np.array([item.relation == ">=" for item in self.study.constraints], dtype=bool)
        return np.asarray(np.where(at_least, values.min(axis=0), values.max(axis=0)))


def _failed(assessment: Assessment) -> NDArray[np.bool_]:
    return np.asarray(assessment.distance_share < 1)


def evaluate_fresh(study: Study, x: FloatArray, evaluator: Evaluator) -> FreshResponses:
    """Evaluate designs x [design, variable] on seeds of tracks and parameter samples that the study does not use.

    All designs have the same tracks and samples in a set, so that their differences do not contain those of the sets.
    """
    sets = [cases_of(study, fresh=k) for k in range(FRESH_SEED_SETS)]
    if not has_seeds(sets[0]):
        return FreshResponses(study, ())
    # all sets in one call, so that all threads and machines are busy
    table = response_table(list(chain(*sets)), x, required_keys(study), evaluator)
    n = len(sets[0])
    of_each = [table.select_cases(slice(k * n, (k + 1) * n)) for k in range(FRESH_SEED_SETS)]
    return FreshResponses(study, [assess_responses(study, part) for part in of_each])


def paired_difference(objectives: FloatArray, design: int, reference: int | None) -> Difference:
    """Return the mean difference of a design's objectives from a reference, and Student's paired test of it.

    Parameters
    ----------
    objectives : float [set, design, objective]
    design, reference : int

    Returns
    -------
    dict
        `mean` over the sets, its `standard_error`, and `p_value`, the probability of a mean that large where there is
        no difference, two-sided; None for the reference itself, and where a design failed in any set.

    References
    ----------
    Student, The probable error of a mean, Biometrika 6 (1908).

    Examples
    --------
    >>> pairs = np.array([[[1.0], [3.0]], [[5.0], [6.9]], [[2.0], [4.1]]])
    >>> difference = paired_difference(pairs, 1, 0)
    >>> round(difference["mean"][0], 6), difference["p_value"][0] < 0.01
    (2.0, True)
    """
    count = len(objectives)
    if reference is None or reference == design:
        nothing: list[float | None] = [None] * objectives.shape[2]
        return {"mean": nothing, "standard_error": nothing, "p_value": nothing}
    with np.errstate(invalid="ignore", divide="ignore"):  # failed designs; differences that no seed changes
        own = objectives[:, design]
        differences = own - objectives[:, reference]
        is_rounding = np.isfinite(own) & (np.abs(differences) <= ROUNDING * np.abs(own))
        differences = np.where(is_rounding, 0.0, differences)
        mean, error = differences.mean(axis=0), _standard_deviation(differences, own) / np.sqrt(count)
        p = 2 * stdtr(count - 1, -np.abs(mean / error))
    return {"mean": finite_or_none(mean), "standard_error": finite_or_none(error), "p_value": finite_or_none(p)}


def _standard_deviation(values: FloatArray, objectives: FloatArray) -> FloatArray:
    """Return the standard deviation over the sets of values made of objectives, 0 for one of their rounding."""
    sd = values.std(axis=0, ddof=1)
    return np.asarray(np.where(sd <= ROUNDING * np.abs(objectives).max(axis=0), 0.0, sd))


def is_significant(p_value: float | None) -> bool:
    """Return True for a difference that is significant by its paired test.

    >>> is_significant(0.01), is_significant(0.2), is_significant(None)
    (True, False, False)
    """
    return p_value is not None and p_value < SIGNIFICANCE


def fresh_warnings(study: Study, front: Sequence[Mapping[str, Any]], names: Mapping[int, str]) -> list[str]:
    """Return the warnings on designs that fail or miss a constraint on fresh seeds.

    Parameters
    ----------
    study : Study
    front : sequence of mapping
        Designs of the result, with the key `fresh`.
    names : mapping of int to str
        Names of the designs that are warned of one by one, by number.
    """
    warnings = []
    for i, name in names.items():
        fresh = front[i]["fresh"]
        sets = f"of {fresh['sets']} sets of fresh seeds"
        warnings += [f"{name} fails in {count} {sets}: {reason}" for reason, count in fresh["failures"].items()]
        for constraint, met in zip(study.constraints, fresh["met"], strict=True):
            if met is not None and met < fresh["sets"] - fresh["failed"]:
                warnings.append(f"{name} meets {constraint.text} in only {met} {sets}")
    count = sum(_is_unreliable(point["fresh"]) for point in front)
    if count and len(front) > 1:
        verb = "fails or misses" if count == 1 else "fail or miss"
        warnings.append(f"{count} of {len(front)} designs of the front {verb} a constraint on fresh seeds")
    return warnings


def _is_unreliable(fresh: Mapping[str, Any]) -> bool:
    return bool(fresh["sets"]) and bool(fresh["failed"] or any(met < fresh["sets"] for met in fresh["met"]))
