"""The search for a front: NSGA-II, NSGA-III or differential evolution over whole generations, and the knee."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.optimisation.design_space import Generation, Judge, Ranges, relative_to
from railui.optimisation.objectives import violations
from railui.optimisation.study import Study


def search_pymoo(study: Study, first: FloatArray, judge: Judge) -> Iterator[Generation]:
    """NSGA-II, NSGA-III or differential evolution in ask and tell, from a first generation in the unit cube."""
    from pymoo.core.evaluator import Evaluator
    from pymoo.core.problem import Problem
    from pymoo.problems.static import StaticProblem
    from pymoo.termination import get_termination

    ranges, method, k = Ranges(study.variables), study.method, len(study.variables)
    aims, limits = len(study.objectives), len(study.constraints) + 1
    problem = Problem(n_var=k, n_obj=aims, n_ieq_constr=limits, xl=np.zeros(k), xu=np.ones(k))
    search = _algorithm(study, first)
    search.setup(problem, termination=get_termination("n_gen", method.generations), seed=method.seed, verbose=False)
    while search.has_next():
        tried = search.ask()
        if tried is None or len(tried) == 0:  # every new design has been tried: there is nothing left to find
            return
        x = ranges.values(tried.get("X"))
        judged = judge(x)
        known = StaticProblem(problem, F=relative_to(study, judged), G=violations(study, judged))
        Evaluator().eval(known, tried)
        search.tell(infills=tried)
        yield Generation(x, judged, ranges.values(np.atleast_2d(search.opt.get("X"))))


def _algorithm(study: Study, first: FloatArray) -> Any:
    """The algorithm of a method. Sources: Deb et al., A fast and elitist multiobjective genetic algorithm:
    NSGA-II, IEEE Trans. Evol. Comp. 6 (2002); Deb, Jain, An evolutionary many-objective optimization algorithm
    using reference-point-based nondominated sorting, part I, ibid. 18 (2014); Storn, Price, J. Global Opt. 11 (1997).
    """
    kind, size = study.method.kind, study.method.population
    if kind == "de":
        from pymoo.algorithms.soo.nonconvex.de import DE

        return DE(pop_size=size, sampling=first)
    if kind == "nsga3":
        from pymoo.algorithms.moo.nsga3 import NSGA3
        from pymoo.util.ref_dirs import get_reference_directions

        aims = len(study.objectives)
        # as many directions as there are designs, n parts of a simplex: (n + aims - 1 over aims - 1)
        parts = max(n for n in range(1, size + 1) if n == 1 or comb(n + aims - 1, aims - 1) <= size)
        return NSGA3(get_reference_directions("das-dennis", aims, n_partitions=parts), pop_size=size, sampling=first)
    from pymoo.algorithms.moo.nsga2 import NSGA2

    return NSGA2(pop_size=size, sampling=first)


def knee(objectives: FloatArray, senses: FloatArray) -> int:
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


def hypervolumes(history: Sequence[tuple[int, FloatArray]]) -> list[dict[str, float]]:
    """How much of the space of aims designs dominate after so many evaluations, 1 all of it.

    history: evaluations, and the aims [n, aim] (less is better) of the designs of a generation that keep all
    limits. The space reaches from the best of every aim to the worst on any front. Source: Zitzler, Thiele,
    Multiobjective evolutionary algorithms: a comparative case study, IEEE Trans. Evol. Comp. 3 (1999).

    >>> [row["hypervolume"] for row in hypervolumes([(1, np.array([[1.0, 1.0]])), (2, np.array([[0.0, 0.0]]))])]
    [0.0, 1.0]
    """
    from pymoo.indicators.hv import HV

    fronts, front = [], np.zeros((0, 0))
    for _, aims in history:
        front = _front(np.vstack([front, aims]) if front.size else aims)
        fronts.append(front)
    if not front.size:
        return []
    known = np.vstack([one for one in fronts if one.size])
    low, width = known.min(axis=0), np.ptp(known, axis=0)
    volume = HV(ref_point=np.ones(known.shape[1]))
    scaled = [(one - low) / np.where(width > 0, width, 1.0) if one.size else None for one in fronts]
    return [
        {"evaluations": count, "hypervolume": 0.0 if one is None else float(volume(one))}
        for (count, _), one in zip(history, scaled, strict=True)
    ]


def _front(aims: FloatArray) -> FloatArray:
    """Those of aims [n, aim] that no other beats, each once."""
    different = np.unique(aims, axis=0)
    return np.asarray(different[nondominated(different)])


def nondominated(aims: FloatArray) -> NDArray[np.bool_]:
    """Which of aims [n, aim], less being better, no other beats: as good in all and better in one.

    >>> undominated(np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0]])).tolist()
    [True, False, True]
    """
    worse = np.all(aims[:, None] >= aims, axis=2) & np.any(aims[:, None] > aims, axis=2)
    return np.asarray(~worse.any(axis=1))
