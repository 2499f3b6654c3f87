"""Estimates of all other parameters where one is fixed at a value."""

from __future__ import annotations

import numpy as np

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import GaussNewton


def fit_with_parameter_fixed(
    context: Context, fit: Fit, j: int, value: float, *, tolerance: float, max_iterations: int
) -> Fit:
    """Fix parameter j of a fit at a value and estimate the others again, from where the covariance expects them.

    Raises
    ------
    SimulationError
        Where the vehicle diverges there.
    """
    others = np.delete(np.arange(len(fit.x)), j)
    model = fit.model.with_path_values([fit.free.paths[j]], np.array([value]))
    free = fit.free.without_parameter(j)
    optimiser = GaussNewton(context, model, free, fit.segments, block=fit.block)
    ridge = fit.covariance[others, j] / fit.covariance[j, j]
    start = fit.least_squares[others] + ridge * (value - fit.least_squares[j])
    return optimiser.fit(start, tolerance=tolerance, max_iterations=max_iterations)
