"""Search of a study: initial population, generations, coordinate search, and the state in between."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from railui.arrays import FloatArray
from railui.optimisation.design_space import Assess, DesignSpace, Generation, initial_population, minimised_objectives
from railui.optimisation.front import Front
from railui.optimisation.multi_objective import search_pymoo
from railui.optimisation.objectives import Assessment, violations
from railui.optimisation.single_objective import coordinate_search, search_cmaes
from railui.optimisation.study import Study
from railui.progress import Progress


@dataclass(frozen=True, eq=False)
class SearchState:
    """State of a search, an event of its progress.

    Attributes
    ----------
    evaluations : int
        Number of designs evaluated.
    failures : mapping of str to int
        Number of failed designs by reason.
    activity : str
        Description of the current step.
    generation : Generation, optional
        Designs evaluated last.
    baseline : Assessment, optional
        Assessment of the unchanged vehicle.
    """

    evaluations: int = 0
    failures: Mapping[str, int] = field(default_factory=dict)
    activity: str = ""
    generation: Generation | None = field(default=None, repr=False)
    baseline: Assessment | None = field(default=None, repr=False)

    @property
    def failed(self) -> int:
        """Number of designs that failed in any case."""
        return sum(self.failures.values())


def baseline_values(study: Study) -> FloatArray:
    """Return the values [variable] of the unchanged vehicle."""
    return np.array([study.design.value(variable.path) for variable in study.variables])


class Search:
    """Search of a study.

    Attributes
    ----------
    state : SearchState
    least_violation : float
        Least sum of relative violations of any design; 0 if a design meets all constraints.
    nearest : float [variable]
        Design with the least violation.
    front : Front
        Of all feasible designs tried so far.
    history : list of (int, float [n, objective])
        Evaluations, and the minimised objectives of the feasible designs, per generation.
    """

    def __init__(self, study: Study, assess: Assess, progress: Progress) -> None:
        self.study = study
        self.assess = assess
        self.progress = progress
        self.least_violation = np.inf
        self.nearest = baseline_values(study)
        self.front = Front.empty(study)
        self.history: list[tuple[int, FloatArray]] = []
        self.baseline = assess(self.nearest[None])
        self.state = SearchState(baseline=self.baseline)

    def report(self, activity: str) -> None:
        """Report the current step and the state."""
        self.state = replace(self.state, activity=activity)
        self.progress.event(self.state)  # first, so that it is stored even if the message stops the search
        self.progress.message(activity)

    def run(self) -> Front:
        """Search by the study's method, with one objective followed by a coordinate search.

        Returns the front of all designs tried; without designs if none meets the constraints.
        """
        study, method = self.study, self.study.method
        baseline = baseline_values(study)
        first = initial_population(DesignSpace(study.variables), method.population, baseline, method.seed)
        search = search_cmaes if method.kind == "cmaes" else search_pymoo
        generations = search(study, first, self.assess)
        best = self._follow(generations, f"generation {{}} of {method.generations}", baseline)
        if len(study.objectives) == 1:
            self._follow(coordinate_search(study, best, self.assess), "coordinate search {}", best)
        return self.front

    def _follow(self, generations: Iterator[Generation], label: str, best: FloatArray) -> FloatArray:
        """Record and report every generation; return a design of the front, else the best of the method."""
        for number, generation in enumerate(generations, 1):
            best = generation.front[0]
            self._record(generation)
            feasible = f"{len(self.front)} on the front" if len(self.front) else "none meets the constraints yet"
            counts = f"{self.state.evaluations} designs, {self.state.failed} failed, {feasible}"
            self.report(f"{label.format(number)}: {counts}")
        return self.front.x[0] if len(self.front) else best

    def _record(self, generation: Generation) -> None:
        assessment = generation.assessment
        failures = Counter(self.state.failures)
        failures.update(reason for reason in assessment.reasons if reason)
        evaluations = self.state.evaluations + len(generation.x)
        self.state = replace(self.state, evaluations=evaluations, failures=failures, generation=generation)
        violation = np.maximum(violations(self.study, assessment), 0).sum(axis=1)
        if violation.min() < self.least_violation:
            self.least_violation = float(violation.min())
            self.nearest = generation.x[int(np.argmin(violation))]
        feasible = np.flatnonzero(violation == 0)
        tried = Front(generation.x, assessment, minimised_objectives(self.study, assessment)).select(feasible)
        self.front = self.front.including(tried)
        self.history.append((evaluations, tried.costs))
