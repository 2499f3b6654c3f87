"""Knee of a front: the design farthest from the plane through the front's ends, towards the best values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray

THROUGH_ENDS: Final = "ends"
THROUGH_AXES: Final = "axes"
MIN_DISTANCE: Final = 1e-9  # in the unit cube of the objectives: rounding, below it a front does not bulge
SUM_NOTE: Final = (
    "knee: the plane through the ends of the front would count a worse value of an objective as a gain, or the ends "
    "span no plane, so it is the design with the least sum of scaled objectives"
)


@dataclass(frozen=True)
class Knee:
    """Knee of a front.

    Attributes
    ----------
    index : int
        Number of the design on the front.
    through : str, optional
        The plane goes through the ends of the front ("ends"), or through the worst value of every objective on its
        axis ("axes"); None without a choice, on a front of one design.
    distance : float, optional
        Distance from the plane towards the best values, objectives scaled to 0 .. 1; None without a plane.
    """

    index: int
    through: str | None
    distance: float | None


def find_knee(costs: FloatArray) -> Knee:
    """Return the knee of a front: the design farthest from a plane, towards the best values.

    The plane goes through the ends of the front, the best design of every objective. It has to fall in every objective:
    with three and more objectives that run together its normal may count a worse value as a gain, or the ends may
    coincide. Then the plane goes through the worst value of every objective on its axis, from which the farthest design
    is that with the least sum of scaled objectives, the compromise of Yu. With two objectives both planes are the same
    line. Objectives that are equal on the whole front are left out.

    Parameters
    ----------
    costs : float [n, objective]
        Minimised objectives of a front.

    References
    ----------
    Das, On characterizing the "knee" of the Pareto curve, Structural Optimization 18 (1999).
    Yu, A class of solutions for group decision problems, Management Science 19 (1973).

    Examples
    --------
    >>> find_knee(np.array([[0.0, 1.0], [0.2, 0.3], [1.0, 0.0]])).index
    1
    """
    varied = costs[:, np.ptp(costs, axis=0) > 0]
    if not varied.size:
        return Knee(0, None, None)
    scaled = scale(varied)
    normal = _falling_normal(scaled[best_of_each(varied)])
    through = THROUGH_AXES if normal is None else THROUGH_ENDS
    normal = np.ones(scaled.shape[1]) if normal is None else normal
    distance = (1 - scaled @ normal) / np.linalg.norm(normal)
    index = int(np.argmax(distance))
    return Knee(index, through, float(distance[index]))


def _falling_normal(ends: FloatArray) -> FloatArray | None:
    """Return n of the plane n f = 1 through points [objective, objective]; None unless it falls in every objective."""
    if np.linalg.matrix_rank(ends) < len(ends):
        return None
    normal = np.linalg.solve(ends, np.ones(len(ends)))
    return np.asarray(normal) if np.all(normal > 0) else None


def scale(costs: FloatArray) -> FloatArray:
    """Return objectives [n, objective] scaled to 0 .. 1 over the front."""
    width = np.ptp(costs, axis=0)
    return np.asarray((costs - costs.min(axis=0)) / np.where(width > 0, width, 1.0))


def best_of_each(costs: FloatArray) -> NDArray[np.intp]:
    """Return the index of the best design of each objective; of equal ones, of that with the least scaled sum.

    >>> best_of_each(np.array([[0.0, 3.0, 2.0], [0.0, 2.0, 2.0], [1.0, 1.0, 0.0]])).tolist()
    [1, 2, 2]
    """
    sums = scale(costs).sum(axis=1)
    return np.array([np.lexsort((sums, column))[0] for column in costs.T], dtype=np.intp)


def knee_notes(knee: Knee | None) -> list[str]:
    """Return the note on how a knee was chosen; none for the plane through the ends."""
    return [SUM_NOTE] if knee is not None and knee.through == THROUGH_AXES else []


def knee_warnings(knee: Knee | None, designs: int, objectives: int) -> list[str]:
    """Return the warnings on the knee of a front of so many designs for so many objectives."""
    if knee is None or objectives == 1:
        return []
    if designs == 1:
        return ["the front is one design, of all tried the best in every objective: there is no knee to choose"]
    if knee.distance is None or knee.distance >= MIN_DISTANCE:
        return []
    front = "the front of two designs" if designs == 2 else "the front"
    return [f"{front} does not bulge towards the best values: its knee, design {knee.index}, is no compromise"]
