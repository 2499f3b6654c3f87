"""Optimisation of a vehicle by a study: search, front on fresh seeds, sensitivities, ride quality."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.optimisation.cases import Case, cases_of
from railui.optimisation.design_space import DesignSpace, values_by_path
from railui.optimisation.evaluation import Evaluator, evaluate_in_process, response_table
from railui.optimisation.front import front_size, hypervolumes
from railui.optimisation.knee import find_knee, knee_notes, knee_warnings
from railui.optimisation.objectives import (
    Assessment,
    assess,
    assess_responses,
    check_objectives,
    finite_or_none,
    required_keys,
    result_warnings,
)
from railui.optimisation.responses import integrable_rows
from railui.optimisation.search import Search, baseline_values
from railui.optimisation.sensitivity import one_at_a_time, sobol
from railui.optimisation.study import Study
from railui.optimisation.study_reader import load_study
from railui.progress import SILENT, Progress
from railui.ride_quality.comfort import fixed_transfer_note
from railui.ride_quality.evaluation import ride_result
from railui.ride_quality.running_safety import running_safety_many
from railui.ride_quality.score import CLASSES
from railui.ride_quality.statistics import ride_statistics
from railui.track import parse_spec

FRESH_SEED_SETS: Final = 8  # on which the front is evaluated again
NO_SEEDS_NOTE: Final = "fresh: null, the tracks are files without seeds, on which a design is evaluated once"
RIDE_QUALITY_KEYS: Final = (
    "score",
    "comfort_hours",
    "weighted_acceleration",
    "weighted_acceleration_1974",
    "wz",
    "flange_fraction",
    "flange_fraction_gaussian",
    "flange_margin",
)


def optimise(
    study: Study | str | Path,
    *,
    seed: int | None = None,
    jobs: int | None = None,
    progress: Progress = SILENT,
    evaluator: Evaluator | None = None,
    samples: int = 0,
) -> dict[str, Any]:
    """Search the variables of a study for better designs.

    Parameters
    ----------
    study : Study, str or Path
        Study or its file.
    seed : int, optional
        Seed instead of that of the study's method.
    jobs : int, optional
        Number of threads; all processors by default.
    progress : Progress
        Receives a message and a `SearchState` after every generation.
    evaluator : Evaluator, optional
        Evaluates the designs instead of this process.
    samples : int
        Samples of Sobol's indices, a power of two; 0 for none.

    Returns
    -------
    dict
        Numbers are finite or None. `pareto` holds the front of all designs tried, thinned to `front_size` and ordered
        by the first objective, `nondominated` its number of designs before; `baseline` is the unchanged vehicle. Each
        design has variables, objectives, constraints (of the worst case) and fresh (mean and standard deviation of the
        objectives over 8 sets of seeds that the search did not use). `knee` is the index of the front's knee,
        `knee_plane` the plane from which it is the farthest. If no design meets the constraints, pareto is empty, knee
        is None and `closest` is the design with the least violation. Further keys: `evaluations`, `failed` (designs
        that left the track or cannot be integrated), `failures` by reason, `hypervolume` after every generation,
        `riding` before and after, `sensitivities` of the knee (else of the unchanged vehicle) to every parameter and,
        with `samples`, Sobol's indices, `notes` on what comfort leaves out, `warnings`.

    Raises
    ------
    FileProblems
        For a study with faults, or with objectives that its cases cannot evaluate.
    """
    start = time.perf_counter()
    study = load_study(study, check_track=parse_spec) if isinstance(study, str | Path) else study
    if seed is not None:
        study = replace(study, method=replace(study.method, seed=seed))
    cases = checked_cases(study)
    evaluate = evaluator or evaluate_in_process(jobs)

    def assess_designs(x: FloatArray) -> Assessment:
        return assess(study, cases, x, evaluate)

    baseline = baseline_values(study)
    search = Search(study, assess_designs, progress)
    tried = search.run()
    front = tried.thinned(front_size(study))
    if has_seeds(cases):
        search.report(f"evaluating {len(front) + 1} designs again on {FRESH_SEED_SETS} sets of fresh seeds")
    fresh = fresh_objectives(study, np.vstack([baseline, front.x]), evaluate)
    knee = find_knee(front.costs) if len(front) else None
    best = None if knee is None else knee.index
    search.report("computing sensitivities")
    selected = baseline if best is None else front.x[best]
    sensitivities = {
        "one_at_a_time": one_at_a_time(study, cases, selected, evaluate),
        "sobol": sobol(study, cases, evaluate, samples) if samples else None,
    }
    riding = ride_quality(cases, baseline if best is None else np.stack([baseline, selected]), jobs)
    return {
        "study": study.name,
        "aims": [{"key": item.key, "sense": item.sense, "over": item.over} for item in study.objectives],
        "limits": [constraint.text for constraint in study.constraints],
        "method": vars(study.method),
        "cases": len(cases),
        "pareto": [_point(study, x, front.assessment, i, fresh[:, 1 + i]) for i, x in enumerate(front.x)],
        "nondominated": len(tried),
        "baseline": _point(study, baseline, search.baseline, 0, fresh[:, 0]),
        "knee": best,
        "knee_plane": None if knee is None else {"through": knee.through, "distance": knee.distance},
        "closest": values_by_path(study, search.nearest) if best is None else None,
        "evaluations": search.state.evaluations,
        "failed": search.state.failed,
        "failures": dict(sorted(search.state.failures.items())),
        "hypervolume": hypervolumes(search.history, front_size(study)),
        "riding": {"before": riding[0], "after": None if best is None else riding[1]},
        "sensitivities": sensitivities,
        "notes": [*_notes(study, cases), *knee_notes(knee)],
        "warnings": [
            *knee_warnings(knee, len(front), len(study.objectives)),
            *result_warnings(study, DesignSpace(study.variables).to_unit(front.x), best),
        ],
        "seconds": time.perf_counter() - start,
    }


def checked_cases(study: Study) -> list[Case]:
    """Return the cases of a study; FileProblems if its objectives cannot be evaluated."""
    check_objectives(study)
    cases = cases_of(study)
    check_objectives(study, cases)
    return cases


def has_seeds(cases: Sequence[Case]) -> bool:
    """Return True if a track has a seed: objectives vary from seed to seed."""
    return any(case.excitation.source.seed is not None for case in cases)


def _notes(study: Study, cases: Sequence[Case]) -> list[str]:
    notes = [] if (note := fixed_transfer_note(study.design)) is None else [note]
    return notes if has_seeds(cases) else [*notes, NO_SEEDS_NOTE]


def fresh_objectives(study: Study, x: FloatArray, evaluator: Evaluator) -> FloatArray:
    """Return the objectives [set, design, objective] of designs x [design, variable] on seeds not used by the study.

    NaN if no track has a seed: files without synthetic irregularities.
    """
    objectives = np.full((FRESH_SEED_SETS, len(x), len(study.objectives)), np.nan)
    sets = [cases_of(study, fresh=k) for k in range(FRESH_SEED_SETS)]
    if not has_seeds(sets[0]):
        return objectives
    # all sets in one call, so that all threads and machines are busy
    table = response_table(list(chain(*sets)), x, required_keys(study), evaluator)
    n = len(sets[0])
    for k in range(FRESH_SEED_SETS):
        objectives[k] = assess_responses(study, table.select_cases(slice(k * n, (k + 1) * n))).objectives
    return objectives


def ride_quality(cases: Sequence[Case], x: FloatArray, jobs: int | None = None) -> list[dict[str, Any] | None]:
    """Return the ride quality of designs x [n, variable]: means over the cases and the worst class.

    None for a design that is too stiff to be integrated in any case.
    """
    results: list[list[dict[str, Any]]] = [[] for _ in np.atleast_2d(x)]
    for case in cases:
        model, excitation = case.vehicle.model, case.excitation
        rows = case.vehicle.rows(np.atleast_2d(x))
        integrable, steps = integrable_rows(model, rows, excitation)
        if len(integrable):
            statistics = ride_statistics(model, rows[integrable], excitation, steps=steps, jobs=jobs)
            vehicles = [model.with_row(row) for row in rows[integrable]]
            safety = running_safety_many(vehicles, excitation, steps, jobs)
            for k, i in enumerate(integrable):
                results[i].append(ride_result(vehicles[k], statistics, k, excitation, safety[k]))
    return [mean_ride_quality(each) if len(each) == len(cases) else None for each in results]


def mean_ride_quality(results: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the means of ride results over cases, None for a key that is None in any, and the worst class."""
    worst = min(results, key=lambda result: CLASSES.index(result["class"]))
    means: dict[str, Any] = {}
    for key in RIDE_QUALITY_KEYS:
        values = [result[key] for result in results]
        means[key] = None if any(value is None for value in values) else float(np.mean(values))
    shares = [result["safety_share"] for result in results if result["safety_share"] is not None]
    means["safety_share"] = max(shares, default=None)  # the worst, like the class
    return {"class": worst["class"], "decided_by": worst["decided_by"], **means}


def _point(study: Study, x: FloatArray, assessment: Assessment, i: int, fresh: FloatArray) -> dict[str, Any]:
    """Return one design of the result; fresh [set, objective]."""
    with np.errstate(invalid="ignore"):
        mean, sd = fresh.mean(axis=0), fresh.std(axis=0, ddof=1)
    return {
        "variables": values_by_path(study, x),
        "objectives": finite_or_none(assessment.objectives[i]),
        "constraints": finite_or_none(assessment.constraints[i]),
        "fresh": {"mean": finite_or_none(mean), "sd": finite_or_none(sd)},
    }
