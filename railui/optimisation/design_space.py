"""What every search walks in: ranges as a unit cube, the first generation, designs tried and judged together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.arrays import FloatArray
from railui.optimisation.objectives import BAD, Assessed, sign
from railui.optimisation.study import Study, Variable

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
        self.ratio = np.where(self.decades, self.high / np.where(self.decades, self.low, 1.0), DECADE)

    def values(self, unit: FloatArray) -> FloatArray:
        """Values [n, variable] of points [n, variable] in the cube."""
        even = self.low + unit * (self.high - self.low)
        return np.clip(np.where(self.decades, self.low * self.ratio**unit, even), self.low, self.high)

    def unit(self, values: FloatArray) -> FloatArray:
        """Points of the cube, outside it where a value is out of range."""
        positive = np.maximum(values, np.finfo(float).tiny) / np.where(self.decades, self.low, 1.0)
        even = (values - self.low) / (self.high - self.low)
        return np.asarray(np.where(self.decades, np.log(positive) / np.log(self.ratio), even))


def first_generation(ranges: Ranges, count: int, declared: FloatArray, seed: int) -> FloatArray:
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


@dataclass(frozen=True, eq=False)
class Generation:
    """Designs tried together: values x [n, variable] and how they were judged; values of the front so far."""

    x: FloatArray
    judged: Assessed
    front: FloatArray


Judge = Callable[[FloatArray], Assessed]


def relative_to(study: Study, judged: Assessed) -> FloatArray:
    """Objectives [n, aim] of which less is better; what is infinite or missing is as bad as can be."""
    senses = np.array([sign(objective) for objective in study.objectives])
    # a NaN would cut pymoo's front without a word
    return np.asarray(np.clip(np.nan_to_num(senses * judged.objectives, nan=BAD), -BAD, BAD))
