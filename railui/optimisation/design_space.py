"""Design space of a study: ranges as a unit cube, the initial population, generations of designs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.arrays import FloatArray
from railui.optimisation.objectives import PENALTY, Assessment, objective_sign
from railui.optimisation.study import Study, Variable

INITIAL_POPULATION_STREAM: Final = 0  # random stream of the initial population, combined with the seed
MIN_LOGARITHMIC_RATIO: Final = 10.0  # a positive range with at least this ratio of its ends is scaled by its logarithm


class DesignSpace:
    """Mapping between the ranges of variables and the unit cube.

    A positive range over a decade or more is scaled by its logarithm, any other range linearly.

    Examples
    --------
    >>> space = DesignSpace([Variable("vehicle.secondary.yaw_damping", 1e3, 1e5, "N*m*s/rad")])
    >>> space.from_unit(np.array([[0.5]])).round(6).tolist(), space.to_unit(np.array([[1e5]])).tolist()
    ([[10000.0]], [[1.0]])
    """

    def __init__(self, variables: Sequence[Variable]) -> None:
        self.low = np.array([variable.lowest for variable in variables])
        self.high = np.array([variable.highest for variable in variables])
        self.is_logarithmic = (self.low > 0) & (self.high >= MIN_LOGARITHMIC_RATIO * self.low)
        safe_low = np.where(self.is_logarithmic, self.low, 1.0)
        self.ratio = np.where(self.is_logarithmic, self.high / safe_low, MIN_LOGARITHMIC_RATIO)

    def from_unit(self, unit: FloatArray) -> FloatArray:
        """Return the values [n, variable] of points [n, variable] in the unit cube."""
        linear = self.low + unit * (self.high - self.low)
        return np.clip(np.where(self.is_logarithmic, self.low * self.ratio**unit, linear), self.low, self.high)

    def to_unit(self, values: FloatArray) -> FloatArray:
        """Return points [n, variable] of the unit cube; a value out of range gives a point outside the cube."""
        safe_low = np.where(self.is_logarithmic, self.low, 1.0)
        positive = np.maximum(values, np.finfo(float).tiny) / safe_low
        linear = (values - self.low) / (self.high - self.low)
        return np.asarray(np.where(self.is_logarithmic, np.log(positive) / np.log(self.ratio), linear))


def initial_population(space: DesignSpace, count: int, baseline: FloatArray, seed: int) -> FloatArray:
    """Return a Latin hypercube [count, variable] in the unit cube.

    The first point is the unchanged vehicle, `baseline` [variable], if it lies inside the ranges.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, INITIAL_POPULATION_STREAM]))
    strata = rng.permuted(np.tile(np.arange(count), (len(baseline), 1)), axis=1).T
    points = (strata + rng.random(strata.shape)) / count
    baseline_point = space.to_unit(baseline)
    if np.all((baseline_point >= 0) & (baseline_point <= 1)):
        points[0] = baseline_point
    return np.asarray(points)


@dataclass(frozen=True, eq=False)
class Generation:
    """Designs x [n, variable] evaluated together, their assessment, and the front [m, variable] so far."""

    x: FloatArray
    assessment: Assessment
    front: FloatArray


# objectives and constraints of designs [n, variable]
Assess = Callable[[FloatArray], Assessment]


def minimised_objectives(study: Study, assessment: Assessment) -> FloatArray:
    """Return the objectives [n, objective] with the sign of minimisation, finite for the search."""
    signs = np.array([objective_sign(objective) for objective in study.objectives])
    # pymoo drops a NaN from its front silently
    finite = np.nan_to_num(signs * assessment.objectives, nan=PENALTY)
    return np.asarray(np.clip(finite, -PENALTY, PENALTY))


def values_by_path(study: Study, x: FloatArray) -> dict[str, float]:
    """Return the values of a design x [variable] by path."""
    return {variable.path: float(value) for variable, value in zip(study.variables, x, strict=True)}
