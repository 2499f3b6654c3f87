"""Multi-objective search by NSGA-II, NSGA-III or differential evolution; the front, its knee and its hypervolume."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.optimisation.design_space import Assess, DesignSpace, Generation, minimised_objectives
from railui.optimisation.objectives import violations
from railui.optimisation.study import Study


def search_pymoo(study: Study, first: FloatArray, assess: Assess) -> Iterator[Generation]:
    """Search by NSGA-II, NSGA-III or differential evolution from an initial population in the unit cube.

    Yields every generation after its evaluation; ends early if the algorithm proposes no new design.
    """
    from pymoo.core.evaluator import Evaluator
    from pymoo.core.problem import Problem
    from pymoo.problems.static import StaticProblem
    from pymoo.termination import get_termination

    space, method, n = DesignSpace(study.variables), study.method, len(study.variables)
    problem = Problem(
        n_var=n,
        n_obj=len(study.objectives),
        n_ieq_constr=len(study.constraints) + 1,
        xl=np.zeros(n),
        xu=np.ones(n),
    )
    algorithm = _algorithm(study, first)
    algorithm.setup(problem, termination=get_termination("n_gen", method.generations), seed=method.seed, verbose=False)
    while algorithm.has_next():
        population = algorithm.ask()
        if population is None or len(population) == 0:  # every design it can make is a duplicate
            return
        x = space.from_unit(population.get("X"))
        assessment = assess(x)
        evaluated = StaticProblem(problem, F=minimised_objectives(study, assessment), G=violations(study, assessment))
        Evaluator().eval(evaluated, population)
        algorithm.tell(infills=population)
        yield Generation(x, assessment, space.from_unit(np.atleast_2d(algorithm.opt.get("X"))))


def _algorithm(study: Study, first: FloatArray) -> Any:
    """Return the pymoo algorithm of the study's method.

    References
    ----------
    Deb et al., A fast and elitist multiobjective genetic algorithm: NSGA-II, IEEE Trans. Evol. Comp. 6 (2002).
    Deb, Jain, An evolutionary many-objective optimization algorithm using reference-point-based nondominated
    sorting, part I, IEEE Trans. Evol. Comp. 18 (2014).
    Storn, Price, Differential evolution, J. Global Opt. 11 (1997).
    """
    kind, size = study.method.kind, study.method.population
    if kind == "de":
        from pymoo.algorithms.soo.nonconvex.de import DE

        return DE(pop_size=size, sampling=first)
    if kind == "nsga3":
        from pymoo.algorithms.moo.nsga3 import NSGA3
        from pymoo.util.ref_dirs import get_reference_directions

        m = len(study.objectives)
        # a simplex with n partitions has (n + m - 1 over m - 1) directions: at most one per design
        partitions = max(n for n in range(1, size + 1) if n == 1 or comb(n + m - 1, m - 1) <= size)
        directions = get_reference_directions("das-dennis", m, n_partitions=partitions)
        return NSGA3(directions, pop_size=size, sampling=first)
    from pymoo.algorithms.moo.nsga2 import NSGA2

    return NSGA2(pop_size=size, sampling=first)


def knee(objectives: FloatArray, signs: FloatArray) -> int:
    """Return the index of the knee of a front: the design farthest from the plane through the front's ends.

    Parameters
    ----------
    objectives : float [n, objective]
        Front; every objective is scaled to 0 .. 1.
    signs : float [objective]
        1 for an objective to minimise, -1 for one to maximise.

    References
    ----------
    Das, On characterizing the "knee" of the Pareto curve, Structural Optimization 18 (1999).

    Examples
    --------
    >>> knee(np.array([[0.0, 1.0], [0.2, 0.3], [1.0, 0.0]]), np.array([1.0, 1.0]))
    1
    """
    f = signs * objectives
    width = np.ptp(f, axis=0)
    scaled = (f - f.min(axis=0)) / np.where(width > 0, width, 1.0)
    return int(np.argmin(scaled.sum(axis=1)))


def hypervolumes(history: Sequence[tuple[int, FloatArray]]) -> list[dict[str, float]]:
    """Return the dominated share of the objective space, 0 .. 1, after every generation.

    The objective space reaches from the best value of every objective to the worst on any front.

    Parameters
    ----------
    history : sequence of (int, float [n, objective])
        Number of evaluations, and the minimised objectives of the designs of a generation that meet all constraints.

    References
    ----------
    Zitzler, Thiele, Multiobjective evolutionary algorithms: a comparative case study, IEEE Trans. Evol. Comp. 3
    (1999).

    Examples
    --------
    >>> [row["hypervolume"] for row in hypervolumes([(1, np.array([[1.0, 1.0]])), (2, np.array([[0.0, 0.0]]))])]
    [0.0, 1.0]
    """
    from pymoo.indicators.hv import HV

    fronts, front = [], np.zeros((0, 0))
    for _, objectives in history:
        front = _front(np.vstack([front, objectives]) if front.size else objectives)
        fronts.append(front)
    if not front.size:
        return []
    points = np.vstack([each for each in fronts if each.size])
    low, width = points.min(axis=0), np.ptp(points, axis=0)
    volume = HV(ref_point=np.ones(points.shape[1]))
    scaled = [(each - low) / np.where(width > 0, width, 1.0) if each.size else None for each in fronts]
    return [
        {"evaluations": count, "hypervolume": 0.0 if each is None else float(volume(each))}
        for (count, _), each in zip(history, scaled, strict=True)
    ]


def _front(objectives: FloatArray) -> FloatArray:
    """Return the nondominated rows of minimised objectives [n, objective], each once."""
    unique = np.unique(objectives, axis=0)
    return np.asarray(unique[nondominated(unique)])


def nondominated(objectives: FloatArray) -> NDArray[np.bool_]:
    """Return True for each of n minimised objectives [n, objective] that no other dominates.

    One dominates another if it is as good in all objectives and better in one.

    >>> nondominated(np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0]])).tolist()
    [True, False, True]
    """
    no_better = np.all(objectives[:, None] >= objectives, axis=2)
    worse = np.any(objectives[:, None] > objectives, axis=2)
    return np.asarray(~(no_better & worse).any(axis=1))
