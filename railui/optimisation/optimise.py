"""Optimisation of a vehicle by a study: search, front on fresh seeds, sensitivities, ride quality."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.optimisation.cases import Case, cases_of, has_seeds, vehicles_of
from railui.optimisation.design_space import DesignSpace, values_by_path
from railui.optimisation.evaluation import Evaluator, evaluate_in_process
from railui.optimisation.fresh import FRESH_SEED_SETS, evaluate_fresh, fresh_warnings
from railui.optimisation.front import Front, front_size, hypervolumes
from railui.optimisation.knee import best_of_each, find_knee, knee_notes, knee_warnings
from railui.optimisation.objectives import (
    Assessment,
    assess,
    check_objectives,
    finite_or_none,
    result_warnings,
)
from railui.optimisation.responses import integrable_rows
from railui.optimisation.search import Search, baseline_values
from railui.optimisation.sensitivity import one_at_a_time, sobol
from railui.optimisation.sobol_intervals import width_warnings
from railui.optimisation.study import Study
from railui.optimisation.study_reader import load_study
from railui.optimisation.validity import flange_warnings, linear_notes
from railui.progress import SILENT, Progress
from railui.ride_quality.comfort import fixed_transfer_note
from railui.ride_quality.evaluation import ride_result
from railui.ride_quality.running_safety import running_safety_many
from railui.ride_quality.score import CLASSES
from railui.ride_quality.statistics import ride_statistics
from railui.track import parse_spec

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
        design has variables, objectives, constraints (of the worst case) and fresh, its results on 8 sets of seeds that
        the search did not use: mean and standard deviation of the objectives, paired differences to the baseline and to
        the knee, and in how many sets it meets the constraints and fails. `knee` is the index of the front's knee,
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
    knee = find_knee(front.costs) if len(front) else None
    best = None if knee is None else knee.index
    x, assessment = np.vstack([baseline, front.x]), search.baseline.followed_by(front.assessment)
    fresh = evaluate_fresh(study, x, evaluate)
    summaries = [fresh.summary(i, 0, None if best is None else 1 + best) for i in range(len(x))]
    points = [_point(study, x[i], assessment, i, summary) for i, summary in enumerate(summaries)]
    search.report("computing sensitivities")
    selected = baseline if best is None else front.x[best]
    sensitivities: dict[str, Any] = {
        "one_at_a_time": one_at_a_time(study, cases, selected, evaluate),
        "sobol": sobol(study, cases, evaluate, samples) if samples else None,
    }
    compared = {"baseline": baseline} | ({} if best is None else {"knee": selected})
    riding = ride_quality(cases, baseline if best is None else np.stack([baseline, selected]), jobs)
    return {
        "study": study.name,
        "aims": [{"key": item.key, "sense": item.sense, "over": item.over} for item in study.objectives],
        "limits": [constraint.text for constraint in study.constraints],
        "method": vars(study.method),
        "cases": len(cases),
        "pareto": points[1:],
        "nondominated": len(tried),
        "baseline": points[0],
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
            *fresh_warnings(study, points[1:], _selected_names(study, front, best)),
            *result_warnings(study, DesignSpace(study.variables).to_unit(front.x), best),
            *width_warnings(sensitivities["sobol"]),
            *flange_warnings(study, {name: vehicles_of(cases, values) for name, values in compared.items()}),
        ],
        "seconds": time.perf_counter() - start,
    }


def checked_cases(study: Study) -> list[Case]:
    """Return the cases of a study; FileProblems if its objectives cannot be evaluated."""
    check_objectives(study)
    cases = cases_of(study)
    check_objectives(study, cases)
    return cases


def _notes(study: Study, cases: Sequence[Case]) -> list[str]:
    notes = [*([] if (note := fixed_transfer_note(study.design)) is None else [note]), *linear_notes(study)]
    return notes if has_seeds(cases) else [*notes, NO_SEEDS_NOTE]


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


def _point(study: Study, x: FloatArray, assessment: Assessment, i: int, fresh: dict[str, Any]) -> dict[str, Any]:
    """Return design i of an assessment as one of the result."""
    return {
        "variables": values_by_path(study, x),
        "objectives": finite_or_none(assessment.objectives[i]),
        "constraints": finite_or_none(assessment.constraints[i]),
        "fresh": fresh,
    }


def _selected_names(study: Study, front: Front, knee: int | None) -> dict[int, str]:
    """Return the names of the knee and of the best design of every objective by number on the front."""
    if knee is None:
        return {}
    names = {knee: "the knee" if len(study.objectives) > 1 else "the best design"}
    for objective, i in zip(study.objectives, best_of_each(front.costs), strict=True):
        names.setdefault(int(i), f"design {i}, the best in {objective.key}, {objective.over},")
    return names
