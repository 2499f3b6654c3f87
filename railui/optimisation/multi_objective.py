"""Search by NSGA-II, NSGA-III or differential evolution."""

from __future__ import annotations

from collections.abc import Iterator
from math import comb
from typing import Any

import numpy as np

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
