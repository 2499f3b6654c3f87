"""The search with one aim: CMA-ES over whole generations, and the polish of what a search has found."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.optimisation.design_space import Generation, Judge, Ranges, relative_to
from railui.optimisation.objectives import BAD, Assessed, violations
from railui.optimisation.study import Study

STEPS: Final = 1  # what the random numbers of CMA-ES are keyed by, beside the seed
SIGMA: Final = 0.25  # first step, a share of the ranges
COARSE, FINE = 0.05, 2.0**-13  # steps of the polish, shares of the ranges
POLLS: Final = 60  # at most


def merit(study: Study, judged: Assessed) -> FloatArray:
    """One number [n] of which less is better: the aim where all limits are kept, else behind all of these."""
    beyond = np.maximum(violations(study, judged), 0).sum(axis=1)
    return np.where(beyond > 0, BAD * (1 + beyond), relative_to(study, judged)[:, 0])


def search_cmaes(study: Study, first: FloatArray, judge: Judge) -> Iterator[Generation]:
    """CMA-ES from the best of a first generation in the unit cube.

    Its steps look at nothing but the order of designs, so a limit or a failure needs no penalty to be weighed.
    Source: Hansen, Ostermeier, Completely derandomized self-adaptation in evolution strategies, Evol. Comp. 9
    (2001), as the package cma has it.
    """
    from cma import CMAEvolutionStrategy

    ranges, method = Ranges(study.variables), study.method
    rng = np.random.default_rng(np.random.SeedSequence([method.seed, STEPS]))
    one, least = first, _Best(study, ranges)
    yield least.generation(one, judge)
    options: dict[str, Any] = {
        "bounds": [0, 1], "popsize": method.population, "seed": np.nan, "verbose": -9,
        "randn": lambda *shape: rng.standard_normal(shape),
    }  # fmt: skip
    search = CMAEvolutionStrategy(least.unit, SIGMA, options)
    for _ in range(method.generations - 1):
        if search.stop():
            return
        one = np.array(search.ask())
        yield least.generation(one, judge)
        search.tell(list(one), least.merits.tolist())


def polish(study: Study, x: FloatArray, judge: Judge) -> Iterator[Generation]:
    """From values x [variable] to a better neighbour: every variable up and down by a step, together and alone.

    The best of a poll is the next centre; where none is better the step is halved. Source: Kolda, Lewis,
    Torczon, Optimization by direct search, SIAM Review 45 (2003), 3.1: the coordinate search, with the sum of
    all steps that helped as one trial more.
    """
    ranges = Ranges(study.variables)
    best = _Best(study, ranges)
    yield best.generation(np.clip(ranges.unit(x[None]), 0, 1), judge)
    step = COARSE
    for _ in range(POLLS):
        if step < FINE:
            return
        centre, before = best.unit, best.merit
        moves = step * np.vstack([np.eye(len(centre)), -np.eye(len(centre))])
        poll = np.clip(centre + moves, 0, 1)
        yield best.generation(poll, judge)
        together = moves[best.merits < before].sum(axis=0)
        if np.count_nonzero(together) > 1:
            yield best.generation(np.clip(centre + together, 0, 1)[None], judge)
        if not best.merit < before:
            step /= 2


class _Best:
    """The best design so far: its place in the unit cube, its merit; the merits of the last ones tried."""

    def __init__(self, study: Study, ranges: Ranges) -> None:
        self.study, self.ranges = study, ranges
        self.merit, self.unit, self.merits = np.inf, np.zeros(len(ranges.low)), np.zeros(0)

    def generation(self, unit: FloatArray, judge: Judge) -> Generation:
        """Judges designs [n, variable] of the unit cube and keeps the best."""
        x = self.ranges.values(unit)
        judged = judge(x)
        self.merits = merit(self.study, judged)
        i = int(np.argmin(self.merits))
        if self.merits[i] < self.merit:
            self.merit, self.unit = float(self.merits[i]), unit[i]
        return Generation(x, judged, self.ranges.values(self.unit[None]))
