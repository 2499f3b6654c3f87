"""Front of a search: the feasible designs that no other one tried beats, thinned to a size, and its hypervolume."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.optimisation.knee import best_of_each, find_knee, scale
from railui.optimisation.objectives import Assessment
from railui.optimisation.study import Study


@dataclass(frozen=True, eq=False)
class Front:
    """Feasible designs that no other one dominates, in the order in which they were tried.

    Attributes
    ----------
    x : float [n, variable]
    assessment : Assessment
        Of these designs.
    costs : float [n, objective]
        Their minimised objectives.
    """

    x: FloatArray
    assessment: Assessment
    costs: FloatArray

    @classmethod
    def empty(cls, study: Study) -> Front:
        """Return a front without designs."""
        x, costs, constraints = (
            np.zeros((0, len(items))) for items in (study.variables, study.objectives, study.constraints)
        )
        return cls(x, Assessment(costs, constraints, np.zeros(0), []), costs)

    def __len__(self) -> int:
        return len(self.x)

    def select(self, indices: NDArray[np.intp]) -> Front:
        """Return the designs with these indices."""
        return Front(self.x[indices], self.assessment.select(indices), self.costs[indices])

    def including(self, tried: Front) -> Front:
        """Return the front of these designs and of others that were tried later."""
        x, costs = np.vstack([self.x, tried.x]), np.vstack([self.costs, tried.costs])
        both = Front(x, self.assessment.followed_by(tried.assessment), costs)
        return both.select(_joined_front(self.costs, tried.costs))

    def thinned(self, size: int) -> Front:
        """Return at most so many designs, see `thin`, ordered by the first objective."""
        chosen = np.sort(thin(self.costs, size))
        return self.select(chosen[np.argsort(self.costs[chosen, 0], kind="stable")])


def front_size(study: Study) -> int:
    """Return the number of designs to which the front of a study is thinned.

    The population, but enough for the best and the worst design of every objective and the knee.
    """
    return max(study.method.population, 2 * len(study.objectives) + 1)


def thin(costs: FloatArray, size: int) -> NDArray[np.intp]:
    """Return the indices of at most so many designs of a front.

    The best and the worst design of every objective and the knee always stay, so that the thinned front has the range,
    the ends and the knee of the whole one. Others are added one by one, each the farthest from those chosen so far: no
    design left out is farther from the nearest of these than twice the least possible.

    Parameters
    ----------
    costs : float [n, objective]
        Minimised objectives of a front, each row once.
    size : int

    References
    ----------
    Gonzalez, Clustering to minimize the maximum intercluster distance, Theoretical Computer Science 38 (1985).

    Examples
    --------
    >>> thin(np.array([[0.0, 1.0], [0.1, 0.9], [0.3, 0.3], [0.5, 0.25], [1.0, 0.0]]), 4).tolist()
    [0, 4, 2, 3]
    """
    if len(costs) <= size:
        return np.arange(len(costs))
    kept = list(dict.fromkeys([*best_of_each(costs), *best_of_each(-costs), find_knee(costs).index]))
    scaled = scale(costs)
    distance = np.min([np.linalg.norm(scaled - scaled[i], axis=1) for i in kept], axis=0)
    while len(kept) < size:
        kept.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(scaled - scaled[kept[-1]], axis=1))
    return np.array(kept, dtype=np.intp)


def hypervolumes(history: Sequence[tuple[int, FloatArray]], size: int | None = None) -> list[dict[str, float]]:
    """Return the dominated share of the objective space, 0 .. 1, after every generation.

    The objective space reaches from the best value of every objective to the worst on any front.

    Parameters
    ----------
    history : sequence of (int, float [n, objective])
        Number of evaluations, and the minimised objectives of the designs of a generation that meet all constraints.
    size : int, optional
        Number of designs to which a front is thinned; by default it is not.

    Returns
    -------
    list of dict
        `evaluations`; `hypervolume`, of the front thinned; `tried`, of all designs tried.

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

    fronts = _fronts([costs for _, costs in history])
    if not fronts or not fronts[-1].size:
        return []
    points = np.vstack([each for each in fronts if each.size])
    low, width = points.min(axis=0), np.ptp(points, axis=0)
    indicator = HV(ref_point=np.ones(points.shape[1]))

    def volume(costs: FloatArray) -> float:
        return float(indicator((costs - low) / np.where(width > 0, width, 1.0))) if costs.size else 0.0

    rows = []
    for (count, _), costs in zip(history, fronts, strict=True):
        tried = volume(costs)
        is_thinned = size is not None and len(costs) > size
        delivered = volume(costs[thin(costs, size)]) if is_thinned and size is not None else tried
        rows.append({"evaluations": count, "hypervolume": delivered, "tried": tried})
    return rows


def _fronts(generations: Sequence[FloatArray]) -> list[FloatArray]:
    """Return the front [n, objective] of all designs tried after every generation [n, objective]."""
    fronts: list[FloatArray] = []
    for tried in generations:
        front = fronts[-1] if fronts else tried[:0]
        fronts.append(np.vstack([front, tried])[_joined_front(front, tried)])
    return fronts


def _joined_front(front: FloatArray, tried: FloatArray) -> NDArray[np.intp]:
    """Return the indices of the front of minimised objectives [n, objective] and of others that follow them.

    The rows of the front do not dominate each other; of equal rows the first stays.
    """
    first = np.sort(np.unique(tried, axis=0, return_index=True)[1])
    new = first[nondominated(tried[first])]
    new = new[~np.all(front[:, None] <= tried[new], axis=2).any(axis=0)]
    stays = ~np.all(tried[new, None] <= front, axis=2).any(axis=0)
    return np.concatenate([np.flatnonzero(stays), len(front) + new])


def nondominated(costs: FloatArray) -> NDArray[np.bool_]:
    """Return True for each of n minimised objectives [n, objective] that no other dominates.

    One dominates another if it is as good in all objectives and better in one.

    >>> nondominated(np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0]])).tolist()
    [True, False, True]
    """
    no_better = np.all(costs[:, None] >= costs, axis=2)
    worse = np.any(costs[:, None] > costs, axis=2)
    return np.asarray(~(no_better & worse).any(axis=1))
