"""Single-objective search: CMA-ES over whole generations, and coordinate search from the best design."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.optimisation.design_space import Assess, DesignSpace, Generation, minimised_objectives
from railui.optimisation.objectives import PENALTY, Assessment, violations
from railui.optimisation.study import Study

CMAES_STREAM: Final = 1  # random stream of CMA-ES, combined with the seed
INITIAL_STEP: Final = 0.25  # standard deviation of the first generation of CMA-ES, share of the ranges
INITIAL_POLL_STEP: Final = 0.05  # of the coordinate search, share of the ranges
MIN_POLL_STEP: Final = 2.0**-13  # share of the ranges
MAX_POLLS: Final = 60


def merit(study: Study, assessment: Assessment) -> FloatArray:
    """Return one number [n] to minimise: the objective if all constraints are met, else larger than any of these."""
    violation = np.maximum(violations(study, assessment), 0).sum(axis=1)
    return np.where(violation > 0, PENALTY * (1 + violation), minimised_objectives(study, assessment)[:, 0])


def search_cmaes(study: Study, first: FloatArray, assess: Assess) -> Iterator[Generation]:
    """Search by CMA-ES from the best design of an initial population in the unit cube.

    CMA-ES uses only the order of designs, so violated constraints and failures need no weighted penalty.

    References
    ----------
    Hansen, Ostermeier, Completely derandomized self-adaptation in evolution strategies, Evol. Comp. 9 (2001), as
    implemented by the package cma.
    """
    from cma import CMAEvolutionStrategy

    space, method = DesignSpace(study.variables), study.method
    rng = np.random.default_rng(np.random.SeedSequence([method.seed, CMAES_STREAM]))
    best = _BestDesign(study, space)
    yield best.update(first, assess)
    options: dict[str, Any] = {
        "bounds": [0, 1],
        "popsize": method.population,
        "seed": np.nan,
        "verbose": -9,
        "randn": lambda *shape: rng.standard_normal(shape),
    }
    search = CMAEvolutionStrategy(best.unit, INITIAL_STEP, options)
    for _ in range(method.generations - 1):
        if search.stop():
            return
        population = np.array(search.ask())
        yield best.update(population, assess)
        search.tell(list(population), best.last_merits.tolist())


def coordinate_search(study: Study, x: FloatArray, assess: Assess) -> Iterator[Generation]:
    """Improve values x [variable] by steps up and down in every variable.

    After each poll the sum of all steps that improved the design is tried too. The best design is the next centre;
    without an improvement the step is halved.

    References
    ----------
    Kolda, Lewis, Torczon, Optimization by direct search, SIAM Review 45 (2003), 3.1 (coordinate search; the sum of
    the steps is an addition).
    """
    space = DesignSpace(study.variables)
    best = _BestDesign(study, space)
    yield best.update(np.clip(space.to_unit(x[None]), 0, 1), assess)
    step = INITIAL_POLL_STEP
    for _ in range(MAX_POLLS):
        if step < MIN_POLL_STEP:
            return
        centre, centre_merit = best.unit, best.merit
        moves = step * np.vstack([np.eye(len(centre)), -np.eye(len(centre))])
        yield best.update(np.clip(centre + moves, 0, 1), assess)
        combined = moves[best.last_merits < centre_merit].sum(axis=0)
        if np.count_nonzero(combined) > 1:
            yield best.update(np.clip(centre + combined, 0, 1)[None], assess)
        if not best.merit < centre_merit:
            step /= 2


class _BestDesign:
    """Best design so far as a point of the unit cube, its merit, and the merits of the designs evaluated last."""

    def __init__(self, study: Study, space: DesignSpace) -> None:
        self.study = study
        self.space = space
        self.merit = np.inf
        self.unit = np.zeros(len(space.low))
        self.last_merits = np.zeros(0)

    def update(self, unit: FloatArray, assess: Assess) -> Generation:
        """Evaluate designs [n, variable] of the unit cube and keep the best."""
        x = self.space.from_unit(unit)
        assessment = assess(x)
        self.last_merits = merit(self.study, assessment)
        i = int(np.argmin(self.last_merits))
        if self.last_merits[i] < self.merit:
            self.merit = float(self.last_merits[i])
            self.unit = unit[i]
        return Generation(x, assessment, self.space.from_unit(self.unit[None]))
