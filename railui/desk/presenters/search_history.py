"""History of a search: its generations, its result, and the Pareto front."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.desk.state.plan import Plan
from railui.io.atomic import to_json_value
from railui.optimisation.front import nondominated
from railui.optimisation.objectives import violations

if TYPE_CHECKING:
    from railui.optimisation.search import SearchState


@dataclass(frozen=True, eq=False)
class GenerationSummary:
    """Summary of a generation.

    x: designs [n, variable]; objectives [n, objective]; constraints [n, constraint]: values in the worst case;
    is_feasible [n]: all constraints are met; evaluations and failed: counts since the start; baseline [objective] and
    baseline_constraints [constraint]: values of the baseline.
    """

    x: FloatArray
    objectives: FloatArray
    constraints: FloatArray
    is_feasible: NDArray[np.bool_]
    evaluations: int
    failed: int
    activity: str
    baseline: FloatArray
    baseline_constraints: FloatArray

    @property
    def feasible_objectives(self) -> FloatArray:
        """Objectives of the feasible designs [n, objective]."""
        return self.objectives[self.is_feasible]


class SearchHistory:
    """Generations of the search of a plan, and its result."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.generations: list[GenerationSummary] = []
        self.result: dict[str, Any] | None = None
        self.study_warnings: list[str] = []
        self._on_front = np.zeros(0, dtype=np.intp)  # feasible designs that no other dominates
        self._feasible_count = 0

    @property
    def warnings(self) -> list[str]:
        """Warnings of the study, and of the result once there is one."""
        return [*self.study_warnings, *(self.result["warnings"] if self.result is not None else ())]

    def add(self, generation: GenerationSummary) -> bool:
        """Add a generation; return False if it contains no new evaluations."""
        if self.generations and generation.evaluations <= self.generations[-1].evaluations:
            return False
        self.append(generation)
        return True

    def append(self, generation: GenerationSummary) -> None:
        """Append a generation; its designs are compared with the front only, which dominates all others."""
        self.generations.append(generation)
        count = self._feasible_count + int(generation.is_feasible.sum())
        candidates = np.concatenate([self._on_front, np.arange(self._feasible_count, count)])
        costs = self.feasible_objectives()[candidates] * self.objective_signs
        self._on_front, self._feasible_count = candidates[nondominated(costs)], count

    @property
    def completed(self) -> float:
        """Completed fraction of the search, 0 to 1."""
        evaluations = self.generations[-1].evaluations if self.generations else 0
        return evaluations / (self.plan.population * self.plan.generations)

    @property
    def objective_names(self) -> list[str]:
        """Names of the objectives."""
        return [objective.split()[-1].replace("_", " ") for objective, _ in self.plan.objectives]

    @property
    def objective_signs(self) -> FloatArray:
        """Signs of the objectives: 1 for one to minimise, -1 for one to maximise."""
        return np.array([1.0 if o.startswith("minimise") else -1.0 for o, _ in self.plan.objectives])

    def front(self) -> tuple[FloatArray, FloatArray]:
        """Return designs [n, variable] and objectives [n, objective] of the Pareto front so far, or of the result."""
        if self.result is not None:
            pareto = self.result["pareto"]
            x = np.array([list(design["variables"].values()) for design in pareto]).reshape(len(pareto), -1)
            return x, _number_rows([design["objectives"] for design in pareto], len(self.plan.objectives))
        order = self._front_order()
        return self.feasible_designs()[order], self.feasible_objectives()[order]

    def front_constraints(self) -> FloatArray:
        """Return the constraints [n, constraint] of the designs of `front` in the worst case."""
        if self.result is not None:
            rows = [design["constraints"] for design in self.result["pareto"]]
            return _number_rows(rows, len(self.plan.constraints))
        return self.feasible_constraints()[self._front_order()]

    def _front_order(self) -> NDArray[np.intp]:
        """Return the numbers of the feasible designs on the front, ordered by the first objective."""
        costs = self.feasible_objectives()[self._on_front, 0] * self.objective_signs[0]
        return self._on_front[np.argsort(costs, kind="stable")]

    def feasible_designs(self) -> FloatArray:
        """Return all feasible designs so far [n, variable]."""
        return self._feasible("x", len(self.plan.bounds))

    def feasible_objectives(self) -> FloatArray:
        """Return the objectives of all feasible designs so far [n, objective]."""
        return self._feasible("objectives", len(self.plan.objectives))

    def feasible_constraints(self) -> FloatArray:
        """Return the constraints of all feasible designs so far [n, constraint]."""
        return self._feasible("constraints", len(self.plan.constraints))

    def _feasible(self, name: str, width: int) -> FloatArray:
        rows = [getattr(generation, name)[generation.is_feasible] for generation in self.generations]
        return np.vstack(rows) if rows else np.zeros((0, width))

    @property
    def baseline(self) -> FloatArray:
        """Objectives of the baseline [objective]; NaN before the first generation."""
        return self.generations[-1].baseline if self.generations else np.full(len(self.plan.objectives), np.nan)

    @property
    def baseline_constraints(self) -> FloatArray:
        """Constraints of the baseline [constraint]; NaN before the first generation."""
        unknown = np.full(len(self.plan.constraints), np.nan)
        return self.generations[-1].baseline_constraints if self.generations else unknown

    def fresh_statistics(self, index: int) -> tuple[FloatArray, FloatArray] | None:
        """Return mean and sd [objective] of a design of the front on new seeds that the search did not use.

        None before the result, where the design failed on new seeds, and for track files, which have no seeds.
        """
        if self.result is None or index >= len(self.result["pareto"]):
            return None
        fresh = self.result["pareto"][index]["fresh"]
        mean, sd = _number_rows([fresh["mean"], fresh["sd"]], len(self.plan.objectives))
        return (mean, sd) if np.all(np.isfinite(mean)) and np.all(np.isfinite(sd)) else None

    def design_values(self, index: int) -> dict[str, float] | None:
        """Return the variables of a design of the front by path."""
        x, _ = self.front()
        return dict(zip(self.plan.bounds, x[index].tolist(), strict=True)) if index < len(x) else None


def search_content(history: SearchHistory) -> dict[str, Any]:
    """Return the generations and the result of a search as JSON."""
    return {
        "generations": [to_json_value(vars(generation)) for generation in history.generations],
        "result": to_json_value(history.result),
        "study_warnings": history.study_warnings,
    }


def restore_search(plan: Plan, content: Mapping[str, Any]) -> SearchHistory:
    """Return the stored history of the search of a plan; raise KeyError or TypeError if it cannot be read."""
    history = SearchHistory(plan)
    for row in content["generations"]:
        x = _number_rows(row["x"], len(plan.bounds))
        objectives = _number_rows(row["objectives"], len(plan.objectives))
        feasible = np.array(row["is_feasible"], dtype=bool)
        unknown = [None] * len(plan.constraints)  # of a session that an earlier version stored
        constraints = _number_rows(row.get("constraints", [unknown] * len(x)), len(unknown))
        baseline = _number_rows([row["baseline"]], len(plan.objectives))[0]
        limited = _number_rows([row.get("baseline_constraints", unknown)], len(unknown))[0]
        counts = int(row["evaluations"]), int(row["failed"]), str(row["activity"])
        summary = GenerationSummary(x, objectives, constraints, feasible, *counts, baseline, limited)
        history.append(summary)
    history.result = content["result"]
    history.study_warnings = list(content.get("study_warnings", ()))
    return history


def summarise_generation(study: Any, state: SearchState) -> GenerationSummary | None:
    """Return a summary of the latest generation; the arrays are copied because the search continues."""
    latest = state.generation
    if latest is None:
        return None
    baseline = state.baseline
    return GenerationSummary(
        latest.x.copy(),
        latest.assessment.objectives.copy(),
        latest.assessment.constraints.copy(),
        np.all(violations(study, latest.assessment) <= 0, axis=1),
        state.evaluations,
        state.failed,
        state.activity,
        np.full(len(study.objectives), np.nan) if baseline is None else baseline.objectives[0].copy(),
        np.full(len(study.constraints), np.nan) if baseline is None else baseline.constraints[0].copy(),
    )


def _number_rows(rows: Sequence[Sequence[float | None]], width: int) -> FloatArray:
    """Return rows of JSON numbers as an array [n, width], null as NaN."""
    return np.array([[np.nan if v is None else v for v in row] for row in rows], dtype=float).reshape(len(rows), width)
