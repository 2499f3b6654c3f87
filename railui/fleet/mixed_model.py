"""Hierarchical model of a quantity: fleet mean, vehicles, trends, temperature, load and the sections of a week.

    y = mu + c T + l L + beta m + a_v + b_v m + u_(section, block) + e

with the use m since maintenance, and a_v, b_v, u normal with variances of their own. Vehicles share what they have in
common and keep what is their own: partial pooling. The random effects are those of Henderson's mixed-model equations,
the variances those of a fixed-point iteration for REML; robust against faulty vehicles by Huber's weights of the
residuals and bounded squares of the random effects.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from railui.arrays import FloatArray
from railui.dsp.robust import MAD_TO_SD

HUBER: Final = 2.0  # standard deviations, from which a residual counts less
MAD_EFFICIENCY: Final = 0.37  # of a median absolute deviation: independent values that count
BOUND: Final = 2.0  # standard deviations, from which a random effect counts as this many
BOUNDED_SQUARE: Final = 0.9205  # mean of min(z^2, 4) of a standard normal variable
FIXED: Final = 4  # mean, temperature, load, use
TOLERANCE: Final = 0.02  # relative change of the variances at which the iteration ends
SMALL: Final = 1e-2  # of the variance of a run: no difference
MIN_VARIANCE: Final = 1e-8  # of the residual variance


@dataclass(frozen=True, eq=False)
class MixedModel:
    """Estimates of a quantity.

    Attributes
    ----------
    fixed
        Mean, and slopes over temperature, load and use [4].
    fixed_sd
        Their standard deviations [4].
    level, slope
        Deviations of the vehicles [v] from mean and slope.
    level_sd, slope_sd
        Standard deviations of the deviations [v].
    cells
        Deviations of sections in blocks [cell].
    variance
        Factor of the variances of the runs.
    level_variance, slope_variance, cell_variance
        Between vehicles, and between sections and blocks.
    freedom
        Degrees of freedom of the variance.
    """

    fixed: FloatArray
    fixed_sd: FloatArray
    level: FloatArray
    slope: FloatArray
    level_sd: FloatArray
    slope_sd: FloatArray
    cells: FloatArray
    variance: float
    level_variance: float
    slope_variance: float
    cell_variance: float
    freedom: float


def fit_mixed_model(runs: QuantityRuns, start: MixedModel | None = None, iterations: int = 12) -> MixedModel:
    """Fit a quantity of n runs, from the variances of an earlier fit if there is one."""
    variances, robust = runs.first_variances(start), np.ones(len(runs.y))
    for _ in range(iterations):
        solution = runs.solve(variances, robust)
        robust = np.minimum(1.0, HUBER / np.maximum(solution.size, 1e-12))
        before, variances = variances, runs.next_variances(variances, solution)
        if runs.are_close(before, variances):
            break
    levels, slopes, cells = runs.random_effects(solution.numbers)
    level_sd, slope_sd, _ = runs.random_effects(np.sqrt(np.maximum(solution.open, 0.0)))
    return MixedModel(
        solution.numbers[:FIXED],
        np.sqrt(np.maximum(solution.open[:FIXED], 0.0)),
        levels,
        slopes,
        level_sd,
        slope_sd,
        cells,
        variances.run,
        variances.level,
        variances.slope,
        variances.cell,
        MAD_EFFICIENCY * solution.freedom,
    )


class _Variances(NamedTuple):
    """Factor of the variances of the runs; variances of levels, slopes and cells."""

    run: float
    level: float
    slope: float
    cell: float


@dataclass(frozen=True, eq=False)
class _Solution:
    """Fixed and random effects [n], the variances [n] that the data leave open, and the fit of the runs.

    run_variance: factor of the variances of the runs; size: residuals over their standard deviations [run].
    """

    numbers: FloatArray
    open: FloatArray
    freedom: float
    run_variance: float
    size: FloatArray


class QuantityRuns:
    """Runs of a quantity with their mixed-model equations.

    Parameters
    ----------
    y, sd, use : array [n]
    covariates : array [n, 2]
    vehicle, cell : array [n]
    counts
        Numbers of vehicles and of cells.
    """

    def __init__(
        self,
        y: FloatArray,
        sd: FloatArray,
        covariates: FloatArray,
        use: FloatArray,
        vehicle: NDArray[np.int64],
        cell: NDArray[np.int64],
        counts: tuple[int, int],
    ) -> None:
        vehicles, cells = counts
        self.y, self.sd, self.use, self.counts = y, sd, use, counts
        self.x = np.column_stack([np.ones(len(y)), covariates, use])
        self.columns = (FIXED + vehicle, FIXED + vehicles + vehicle, FIXED + 2 * vehicles + cell)
        self.present = np.bincount(vehicle, minlength=vehicles) > 0
        self.present_cells = np.bincount(cell, minlength=cells) > 0
        self.scatter = float(np.median(np.abs(y - np.median(y))) * MAD_TO_SD) ** 2 or float(np.var(y)) or 1.0
        self.base = float(np.median(sd)) ** 2  # usual variance of a run
        self.spread = float(np.ptp(use)) or 1.0
        self.equations = _Equations(self.x, use, self.columns, FIXED + 2 * vehicles + cells)

    def first_variances(self, start: MixedModel | None) -> _Variances:
        """Variances to start from: those of an earlier fit, or guesses from the scatter of the runs."""
        return _Variances(
            start.variance if start else 1.0,
            (start and start.level_variance) or self.scatter,
            (start and start.slope_variance) or 0.01 * self.scatter / self.spread**2,
            (start and start.cell_variance) or 0.1 * self.scatter,
        )

    def precision(self, variances: _Variances) -> FloatArray:
        """Precisions [n] of fixed and random effects, besides what the runs say."""
        vehicles, cells = self.counts
        x, least = self.x[:, 1:], MIN_VARIANCE * self.base
        # slopes that change the values by their scatter: temperature and use rise together in the first months
        slopes = np.where(np.ptp(x, axis=0) > 0.0, x.var(axis=0) / self.scatter, 1e12)
        levels = np.full(vehicles, 1.0 / max(variances.level, least))
        trends = np.full(vehicles, 1.0 / max(variances.slope, least / self.spread**2))
        return np.concatenate([[0.0], slopes, levels, trends, np.full(cells, 1.0 / max(variances.cell, least))])

    def solve(self, variances: _Variances, robust: FloatArray) -> _Solution:
        """Solve the equations with given variances and weights of the runs."""
        precision = self.precision(variances)
        matrix, right = self.equations.of(robust / (variances.run * self.sd**2), self.y)
        matrix[np.diag_indices(len(precision))] += precision
        inverse = _inverse(matrix)
        numbers, left = inverse @ right, np.diag(inverse)
        level, slope, cell = self.columns
        fitted = self.x @ numbers[:FIXED] + numbers[level] + self.use * numbers[slope] + numbers[cell]
        residual = (self.y - fitted) / self.sd
        freedom = max(len(self.y) - float(np.sum(1.0 - precision * left)), 1.0)
        variance = (MAD_TO_SD * float(np.median(np.abs(residual)))) ** 2 * len(self.y) / freedom
        variance = max(variance, MIN_VARIANCE)
        return _Solution(numbers, left, freedom, variance, np.abs(residual) / np.sqrt(variance))

    def random_effects(self, numbers: FloatArray) -> list[FloatArray]:
        """Split numbers [n] into those of levels, slopes and cells."""
        vehicles = self.counts[0]
        return np.split(numbers[FIXED:], [vehicles, 2 * vehicles])

    def next_variances(self, variances: _Variances, solution: _Solution) -> _Variances:
        """Variances that the solution asks for."""
        present = (self.present, self.present, self.present_cells)
        effects, left = self.random_effects(solution.numbers), self.random_effects(solution.open)
        components = map(_component, variances[1:], effects, left, present)
        return _Variances(solution.run_variance, *components)

    def are_close(self, before: _Variances, after: _Variances) -> bool:
        """Return True if the variances have converged."""
        least = SMALL * np.array([1.0, self.base, self.base / self.spread**2, self.base])
        change = np.abs(np.array(after) - np.array(before))
        return bool(np.all(change <= TOLERANCE * np.maximum(before, least)))


def _component(variance: float, effects: FloatArray, uncertain: FloatArray, present: NDArray[np.bool_]) -> float:
    """Next estimate of the variance s of random effects u, of which the data leave the variances c open.

    Notes
    -----
    REML has s = sum u^2 / sum (1 - c / s), solved by fixed-point iteration: D. A. Harville, J. Am. Stat. Assoc. 72
    (1977) 320. Here u^2 / (s - c), of mean 1, is bounded: P. J. Huber, Robust Statistics (Wiley 1981), ch. 6.
    """
    if present.sum() < 2:
        return 0.0
    known = np.clip(1.0 - uncertain[present] / max(variance, 1e-300), 1e-9, 1.0)
    squares = np.minimum(effects[present] ** 2 / (known * max(variance, 1e-300)), BOUND**2)
    return variance * float(known @ squares) / (BOUNDED_SQUARE * float(known.sum()))


class _Equations:
    """Mixed-model equations, whose few coefficients per run are multiplied once for all iterations."""

    def __init__(self, x: FloatArray, use: FloatArray, columns: tuple[NDArray[np.int64], ...], n: int) -> None:
        ones = np.ones(len(use))
        self.n = n
        self.values = np.column_stack([x, ones, use, ones])
        self.places = np.column_stack([*(np.full(len(use), j) for j in range(x.shape[1])), *columns])
        self.products = self.values[:, :, None] * self.values[:, None, :]
        self.cells = (self.places[:, :, None] * n + self.places[:, None, :]).ravel()

    def of(self, weights: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Matrix [n, n] and right-hand side [n], without the variances of the random effects."""
        n = self.n
        matrix = np.bincount(self.cells, (weights[:, None, None] * self.products).ravel(), n * n).reshape(n, n)
        right = np.bincount(self.places.ravel(), ((weights * y)[:, None] * self.values).ravel(), n)
        return np.asarray(matrix), np.asarray(right)


def _inverse(matrix: FloatArray) -> FloatArray:
    scale = 1.0 / np.sqrt(np.diag(matrix))
    try:
        factor = linalg.cho_factor(matrix * np.outer(scale, scale), lower=True)
    except linalg.LinAlgError:
        return np.asarray(linalg.pinvh(matrix * np.outer(scale, scale)) * np.outer(scale, scale))
    return np.asarray(linalg.cho_solve(factor, np.eye(len(matrix))) * np.outer(scale, scale))
