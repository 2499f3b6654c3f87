"""What the results hang on: every number of the vehicle alone, and the variables over their ranges together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.io.problems import FileProblems
from railui.optimisation.cases import Case
from railui.optimisation.design_space import Ranges
from railui.optimisation.evaluation import Evaluator
from railui.optimisation.objectives import Assessed, assess, assess_by, keys_of
from railui.optimisation.study import Study
from railui.vehicle.design_reader import Design
from railui.vehicle.model import Model
from railui.vehicle.sampling import ParameterisedModel

NUDGE: Final = 0.05  # of a number, up and down
BITES: Final = 2  # what the random numbers of Sobol's samples are keyed by, beside the seed


def one_at_a_time(study: Study, cases: Sequence[Case], x: FloatArray, evaluator: Evaluator) -> list[dict[str, Any]]:
    """How aims and limits of the design with values x [variable] change as each number of the vehicle rises by 10 %.

    From 5 % below to 5 % above, everything else held: a row per path with its unit, its value (SI) and the
    changes `objectives` and `constraints`, None where a neighbour fails. Source: Broersen 1976, 7.3.
    """
    here = study.design.with_values({v.path: float(value) for v, value in zip(study.variables, x, strict=True)})
    paths = [path for path in here.paths() if here.value(path) and _nudged(here, path) is not None]
    numbers = evaluator(cases, _rows(study, cases, x, paths), keys_of(study))
    judged = assess_by(study, numbers)
    objectives, limits = (_rises(table, judged) for table in (judged.objectives, judged.constraints))
    return [
        {
            "path": path,
            "unit": here.unit(path),
            "value": here.value(path),
            "objectives": objectives[i].tolist(),
            "constraints": limits[i].tolist(),
        }
        for i, path in enumerate(paths)
    ]


def _rises(table: FloatArray, judged: Assessed) -> FloatArray:
    """From the lower to the upper neighbour, NaN where one of them failed."""
    kept = np.where((judged.travelled < 1)[:, None], np.nan, table)
    return np.asarray(kept[1::2] - kept[::2])


def _nudged(design: Design, path: str) -> list[Design] | None:
    """The design with one number lower and higher; None where it cannot be either."""
    try:
        return [design.with_values({path: design.value(path) * factor}) for factor in (1 - NUDGE, 1 + NUDGE)]
    except FileProblems:
        return None


def _rows(study: Study, cases: Sequence[Case], x: FloatArray, paths: Sequence[str]) -> list[FloatArray]:
    """Rows [2 x path, row] of both neighbours in every number, for each case."""
    made: dict[int, FloatArray] = {}
    values = {v.path: float(value) for v, value in zip(study.variables, x, strict=True)}
    for case in cases:
        if id(case.vehicle) not in made:
            design = case.vehicle.model.design.with_values(values)
            designs = [one for path in paths for one in _nudged(design, path) or [design, design]]
            each = [
                ParameterisedModel(Model(one), (), case.vehicle.deviations).rows(np.zeros((1, 0)))[0] for one in designs
            ]
            made[id(case.vehicle)] = np.stack(each)
    return [made[id(case.vehicle)] for case in cases]


def sobol(study: Study, cases: Sequence[Case], evaluator: Evaluator, samples: int) -> dict[str, Any]:
    """Sobol's indices of every aim over the variables' ranges, from `samples` (a power of two) x (variables + 2).

    `first`: the share of an aim's variance that a variable brings alone; `total`: with all it acts with.
    `failed`: designs that failed, which stand as the worst that did not. Source: Saltelli et al., Comput. Phys.
    Comm. 181 (2010), as scipy.stats has it.
    """
    from scipy import stats

    ranges, failed = Ranges(study.variables), 0

    def aims(unit: FloatArray) -> FloatArray:
        nonlocal failed
        judged = assess(study, cases, ranges.values(unit.T), evaluator)
        failed += int(np.sum(judged.travelled < 1))
        return np.stack([_filled(one) for one in judged.objectives.T])

    even: Any = [stats.uniform(0, 1)] * len(study.variables)
    rng = np.random.default_rng(np.random.SeedSequence([study.method.seed, BITES]))
    with np.errstate(invalid="ignore", divide="ignore"):
        found = stats.sobol_indices(func=aims, n=samples, dists=even, rng=rng)
    return {
        "samples": samples,
        "failed": failed,
        "variables": [
            {"path": v.path, "first": found.first_order[:, j].tolist(), "total": found.total_order[:, j].tolist()}
            for j, v in enumerate(study.variables)
        ],
    }


def _filled(values: FloatArray) -> FloatArray:
    """Values with what failed (infinite, of its sign) at the worst that did not."""
    finite = values[np.isfinite(values)]
    low, high = (finite.min(), finite.max()) if finite.size else (0.0, 0.0)
    return np.nan_to_num(values, nan=high, posinf=high, neginf=low)
