"""Sensitivities: of a design to every parameter of the vehicle, and of the objectives to the variables (Sobol)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.io.problems import FileProblems
from railui.optimisation.cases import Case
from railui.optimisation.design_space import DesignSpace, values_by_path
from railui.optimisation.evaluation import Evaluator
from railui.optimisation.objectives import Assessment, assess, assess_responses, finite_or_none, required_keys
from railui.optimisation.sobol_intervals import CONFIDENCE, index_intervals
from railui.optimisation.study import Study
from railui.vehicle.design import Design
from railui.vehicle.model import Model
from railui.vehicle.sampling import ParameterisedModel

RELATIVE_STEP: Final = 0.05  # of a parameter, up and down
CLEARANCE_ENDS: Final = ("contact.profiles.gauge", "contact.profiles.back_to_back")  # 5 % of either is no wheelset
SOBOL_STREAM: Final = 2  # random stream of Sobol's samples, combined with the seed


def one_at_a_time(study: Study, cases: Sequence[Case], x: FloatArray, evaluator: Evaluator) -> list[dict[str, Any]]:
    """Compute the changes of objectives and constraints as each parameter of a design rises by 10 %.

    Each parameter goes from 5 % below to 5 % above its value, all others fixed; the gauge and the back-to-back distance
    of profiles by 5 % of their difference.

    Parameters
    ----------
    study : Study
    cases : sequence of Case
    x : float [variable]
        Design.
    evaluator : Evaluator

    Returns
    -------
    list of dict
        Per path its unit, its value (SI) and the changes `objectives` and `constraints`, None if a perturbed design
        fails.

    References
    ----------
    Broersen 1976, 7.3.
    """
    changes = values_by_path(study, x)
    design = study.design.with_values(changes)
    paths = perturbable_paths(design)
    table = evaluator(cases, perturbed_rows(cases, changes, paths), required_keys(study))
    assessment = assess_responses(study, table)
    objectives = _differences(assessment.objectives, assessment)
    constraints = _differences(assessment.constraints, assessment)
    return [
        {
            "path": path,
            "unit": design.unit(path),
            "value": design.value(path),
            "objectives": finite_or_none(objectives[i]),
            "constraints": finite_or_none(constraints[i]),
        }
        for i, path in enumerate(paths)
    ]


def _differences(values: FloatArray, assessment: Assessment) -> FloatArray:
    """Return the change [path] from the lower to the upper perturbed design, NaN if one of them failed."""
    valid = np.where((assessment.distance_share < 1)[:, None], np.nan, values)
    return np.asarray(valid[1::2] - valid[::2])


def _perturbed(design: Design, path: str) -> list[Design] | None:
    """Return the design with one parameter lower and higher; None if a value is outside the permitted range."""
    try:
        if path in CLEARANCE_ENDS:
            step = RELATIVE_STEP * step_scale(design, path)
            return [design.with_values({path: design.value(path) + by}) for by in (-step, step)]
        factors = (1 - RELATIVE_STEP, 1 + RELATIVE_STEP)
        return [design.with_values({path: design.value(path) * factor}) for factor in factors]
    except FileProblems:
        return None


def step_scale(design: Design, path: str) -> float:
    """Return the number of which a parameter changes by 5 %: its value, or the clearance between gauge and wheels."""
    if path not in CLEARANCE_ENDS:
        return design.value(path)
    return design.value(CLEARANCE_ENDS[0]) - design.value(CLEARANCE_ENDS[1])


def perturbable_paths(design: Design) -> list[str]:
    """Return the paths of the numbers of a design that are not zero and may be 5 % smaller and larger."""
    return [path for path in design.paths() if design.value(path) and _perturbed(design, path) is not None]


def perturbed_rows(cases: Sequence[Case], changes: Mapping[str, float], paths: Sequence[str]) -> list[FloatArray]:
    """Return the rows [2 x path, row] of both perturbed designs per path, the lower first, for each case.

    `changes` are values of the design by path, to which the perturbations are added.
    """
    known: dict[int, FloatArray] = {}
    for case in cases:
        if id(case.vehicle) not in known:
            design = case.vehicle.model.design.with_values(changes)
            perturbed = [each for path in paths for each in _perturbed(design, path) or [design, design]]
            known[id(case.vehicle)] = np.stack([_kernel_row(each, case) for each in perturbed])
    return [known[id(case.vehicle)] for case in cases]


def _kernel_row(design: Design, case: Case) -> FloatArray:
    """Return the kernel row [row] of a design with the parameter deviations of a case."""
    model = ParameterisedModel(Model(design), (), case.vehicle.deviations)
    return np.asarray(model.rows(np.zeros((1, 0)))[0])


def sobol(study: Study, cases: Sequence[Case], evaluator: Evaluator, samples: int) -> dict[str, Any]:
    """Compute Sobol's indices of every objective over the ranges of the variables.

    Parameters
    ----------
    study : Study
    cases : sequence of Case
    evaluator : Evaluator
    samples : int
        A power of two; samples x (variables + 2) designs are evaluated.

    Returns
    -------
    dict
        Per variable `first`, the share of an objective's variance due to the variable alone, and `total`, its share
        including interactions, each with the interval [low, high] of `confidence`, `first_interval` and
        `total_interval`; `failed`, the number of failed designs, which count as the worst that did not fail.

    References
    ----------
    Saltelli et al., Comput. Phys. Comm. 181 (2010), as implemented by scipy.stats.
    """
    from scipy import stats

    space = DesignSpace(study.variables)
    failed = 0
    evaluated: list[FloatArray] = []  # the first set of samples, the second, then the first with one variable changed

    def objectives(unit: FloatArray) -> FloatArray:
        nonlocal failed
        assessment = assess(study, cases, space.from_unit(unit.T), evaluator)
        failed += int(np.sum(assessment.distance_share < 1))
        rows = [_replace_failed(column) for column in assessment.objectives.T]
        evaluated.append(np.stack(rows))
        return np.stack(rows + rows[:1])  # scipy removes an axis of one, and fails for one objective of one variable

    uniform: Any = [stats.uniform(0, 1)] * len(study.variables)
    rng = np.random.default_rng(np.random.SeedSequence([study.method.seed, SOBOL_STREAM]))
    with np.errstate(invalid="ignore", divide="ignore"):
        indices = stats.sobol_indices(func=objectives, n=samples, dists=uniform, rng=rng)
    shape = (-1, len(study.variables))
    first, total = (np.reshape(x, shape)[:-1] for x in (indices.first_order, indices.total_order))
    a, b, mixed = evaluated
    ab = np.moveaxis(mixed.reshape(len(mixed), samples, len(study.variables)), -1, 0)
    first_ends, total_ends = index_intervals(a, b, ab, study.method.seed)
    return {
        "samples": samples,
        "failed": failed,
        "confidence": CONFIDENCE,
        "variables": [
            {
                "path": v.path,
                "first": finite_or_none(first[:, j]),
                "total": finite_or_none(total[:, j]),
                "first_interval": [finite_or_none(ends) for ends in first_ends[:, :, j].T],
                "total_interval": [finite_or_none(ends) for ends in total_ends[:, :, j].T],
            }
            for j, v in enumerate(study.variables)
        ],
    }


def _replace_failed(values: FloatArray) -> FloatArray:
    """Replace the values of failed designs (infinite, with the bad sign) by the worst of the others."""
    finite = values[np.isfinite(values)]
    low, high = (finite.min(), finite.max()) if finite.size else (0.0, 0.0)
    return np.nan_to_num(values, nan=high, posinf=high, neginf=low)
