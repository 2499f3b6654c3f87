"""Hierarchical model of a quantity: fleet mean, vehicles, trends, temperature, load and the sections of a week.

    y = mu + c T + l L + beta m + a_v + b_v m + u_(section, block) + e

with the use m since maintenance, and a_v, b_v, u normal with variances of their own. Vehicles share what they have in
common and keep what is their own: partial pooling. The random effects are those of Henderson's mixed-model equations,
the variances those of a fixed-point iteration for REML; robust against faulty vehicles by Huber's weights of the
residuals and bounded squares of the random effects.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from railui.arrays import FloatArray

HUBER: Final = 2.0  # standard deviations, from which a residual counts less
MAD_EFFICIENCY: Final = 0.37  # of a median absolute deviation: independent values that count
BOUND: Final = 2.0  # standard deviations, from which a random effect counts as this many
BOUNDED_SQUARE: Final = 0.9205  # mean of min(z^2, 4) of a standard normal variable
MAD: Final = 1.4826  # standard deviation of a normal variable over its median absolute deviation
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


def fit_mixed_model(
    y: FloatArray,
    sd: FloatArray,
    covariates: FloatArray,
    use: FloatArray,
    vehicle: NDArray[np.int64],
    cell: NDArray[np.int64],
    counts: tuple[int, int],
    start: MixedModel | None = None,
    iterations: int = 12,
) -> MixedModel:
    """Fit a quantity of n runs.

    Parameters
    ----------
    y, sd, use : array [n]
    covariates : array [n, 2]
    vehicle, cell : array [n]
    counts
        Numbers of vehicles and of cells.
    start
        Variances to start from.
    """
    vehicles, cells = counts
    x = np.column_stack([np.ones(len(y)), covariates, use])
    n = FIXED + 2 * vehicles + cells
    columns = (FIXED + vehicle, FIXED + vehicles + vehicle, FIXED + 2 * vehicles + cell)
    scatter = float(np.median(np.abs(y - np.median(y))) * MAD) ** 2 or float(np.var(y)) or 1.0
    base = float(np.median(sd)) ** 2
    # slopes that change the values by their scatter: temperature and use rise together in the first months
    slopes = np.where(np.ptp(x[:, 1:], axis=0) > 0.0, x[:, 1:].var(axis=0) / scatter, 1e12)
    spread = float(np.ptp(use)) or 1.0
    variance = start.variance if start else 1.0
    s_a = (start and start.level_variance) or scatter
    s_b = (start and start.slope_variance) or 0.01 * scatter / spread**2
    s_u = (start and start.cell_variance) or 0.1 * scatter
    robust = np.ones(len(y))
    equations = _Equations(x, use, columns, n)
    for _ in range(iterations):
        weights = robust / (variance * sd**2)
        precision = np.concatenate(
            [
                [0.0],
                slopes,
                np.full(vehicles, 1.0 / max(s_a, MIN_VARIANCE * base)),
                np.full(vehicles, 1.0 / max(s_b, MIN_VARIANCE * base / spread**2)),
                np.full(cells, 1.0 / max(s_u, MIN_VARIANCE * base)),
            ]
        )
        matrix, right = equations.of(weights, y)
        matrix[np.diag_indices(n)] += precision
        inverse = _inverse(matrix)
        solution = inverse @ right
        fitted = x @ solution[:FIXED] + solution[columns[0]] + use * solution[columns[1]] + solution[columns[2]]
        residual = (y - fitted) / sd
        a, b, u = np.split(solution[FIXED:], [vehicles, 2 * vehicles])
        trace = np.diag(inverse)
        freedom = max(len(y) - float(np.sum(1.0 - precision * trace)), 1.0)
        variance_before = variance
        variance = max((MAD * float(np.median(np.abs(residual)))) ** 2 * len(y) / freedom, MIN_VARIANCE)
        size = np.abs(residual) / np.sqrt(variance)
        robust = np.minimum(1.0, HUBER / np.maximum(size, 1e-12))
        present = np.bincount(vehicle, minlength=vehicles) > 0
        before = np.array([variance_before, s_a, s_b, s_u])
        s_a = _component(s_a, a, trace[FIXED : FIXED + vehicles], present)
        s_b = _component(s_b, b, trace[FIXED + vehicles : FIXED + 2 * vehicles], present)
        s_u = _component(s_u, u, trace[FIXED + 2 * vehicles :], np.bincount(cell, minlength=cells) > 0)
        change = np.abs(np.array([variance, s_a, s_b, s_u]) - before)
        if np.all(change <= TOLERANCE * np.maximum(before, np.array([1.0, base, base / spread**2, base]) * SMALL)):
            break
    spread_of = np.sqrt(np.maximum(trace, 0.0))
    return MixedModel(
        solution[:FIXED],
        spread_of[:FIXED],
        a,
        b,
        spread_of[FIXED : FIXED + vehicles],
        spread_of[FIXED + vehicles : FIXED + 2 * vehicles],
        u,
        variance,
        s_a,
        s_b,
        s_u,
        MAD_EFFICIENCY * freedom,
    )


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
