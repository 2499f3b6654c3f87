"""NSGA-II in ask and tell: whole generations of designs, judged elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.files.study import Study, Variable
from railui.study.aims import BAD, Judged, sign, violations

Floats = NDArray[np.float64]

SAMPLING: Final = 0  # what the random numbers of the first generation are keyed by, beside the seed
DECADE: Final = 10.0  # from this ratio of its ends on, a positive range is searched in its logarithm


class Ranges:
    """The variables' ranges as a unit cube; a positive range over a decade or more by its logarithm.

    >>> ranges = Ranges([Variable("vehicle.secondary.yaw_damping", 1e3, 1e5, "N*m*s/rad")])
    >>> ranges.values(np.array([[0.5]])).round(6).tolist(), ranges.unit(np.array([[1e5]])).tolist()
    ([[10000.0]], [[1.0]])
    """

    def __init__(self, variables: Sequence[Variable]) -> None:
        self.low = np.array([variable.lowest for variable in variables])
        self.high = np.array([variable.highest for variable in variables])
        self.decades = (self.low > 0) & (self.high >= DECADE * self.low)
        self.ratio = np.where(self.decades, self.high / np.where(self.decades, self.low, 1.0), np.e)

    def values(self, unit: Floats) -> Floats:
        """Values [n, variable] of points [n, variable] in the cube."""
        even = self.low + unit * (self.high - self.low)
        return np.clip(np.where(self.decades, self.low * self.ratio**unit, even), self.low, self.high)

    def unit(self, values: Floats) -> Floats:
        """Points of the cube, outside it where a value is out of range."""
        positive = np.maximum(values, np.finfo(float).tiny) / np.where(self.decades, self.low, 1.0)
        even = (values - self.low) / (self.high - self.low)
        return np.asarray(np.where(self.decades, np.log(positive) / np.log(self.ratio), even))


def first_generation(ranges: Ranges, count: int, declared: Floats, seed: int) -> Floats:
    """A Latin hypercube [count, variable] in the unit cube.

    The first point is the vehicle as it is, `declared` [variable], where that lies inside the ranges.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, SAMPLING]))
    strata = rng.permuted(np.tile(np.arange(count), (len(declared), 1)), axis=1).T
    found = (strata + rng.random(strata.shape)) / count
    here = ranges.unit(declared)
    if np.all((here >= 0) & (here <= 1)):
        found[0] = here
    return np.asarray(found)


def generations(
    study: Study, declared: Floats, seed: int, judge: Callable[[Floats], Judged]
) -> Iterator[tuple[Floats, Judged, Floats]]:
    """Generation by generation: values tried [n, variable], how they were judged, values of the front so far.

    Designs that exceed a limit or fail come behind all that do not. Source: Deb, Pratap, Agarwal, Meyarivan,
    A fast and elitist multiobjective genetic algorithm: NSGA-II, IEEE Trans. Evol. Comp. 6 (2002).
    """
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.evaluator import Evaluator
    from pymoo.core.problem import Problem
    from pymoo.problems.static import StaticProblem
    from pymoo.termination import get_termination

    ranges, method, k = Ranges(study.variables), study.method, len(study.variables)
    limits = len(study.constraints) + 1
    problem = Problem(n_var=k, n_obj=len(study.objectives), n_ieq_constr=limits, xl=np.zeros(k), xu=np.ones(k))
    begin = first_generation(ranges, method.population, declared, seed)
    search = NSGA2(pop_size=method.population, sampling=begin)
    search.setup(problem, termination=get_termination("n_gen", method.generations), seed=seed, verbose=False)
    senses = np.array([sign(objective) for objective in study.objectives])
    while search.has_next():
        tried = search.ask()
        if tried is None or len(tried) == 0:  # every new design has been tried: there is nothing left to find
            return
        x = ranges.values(tried.get("X"))
        judged = judge(x)
        f = np.clip(np.nan_to_num(senses * judged.objectives, nan=BAD), -BAD, BAD)
        Evaluator().eval(StaticProblem(problem, F=f, G=violations(study, judged)), tried)
        search.tell(infills=tried)
        yield x, judged, ranges.values(search.opt.get("X"))


def knee(objectives: Floats, senses: Floats) -> int:
    """Which of a front [n, aim] lies farthest before the plane through its ends, all aims scaled to 0 .. 1.

    senses [aim]: 1 where less is better, -1 where more is. Source: Das, On characterizing the "knee" of the
    Pareto curve, Structural Optimization 18 (1999).

    >>> knee(np.array([[0.0, 1.0], [0.2, 0.3], [1.0, 0.0]]), np.array([1.0, 1.0]))
    1
    """
    f = senses * objectives
    width = np.ptp(f, axis=0)
    scaled = (f - f.min(axis=0)) / np.where(width > 0, width, 1.0)
    return int(np.argmin(scaled.sum(axis=1)))
