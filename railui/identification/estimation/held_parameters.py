"""Spread of estimates that follow a parameter which only a prior determines, beyond the linear covariance.

The data often determine a combination of parameters only. A lateral stiffness of the contact, epsilon (1 - kappa_s/r),
leaves the gravitational stiffness epsilon as 1/(1 - kappa_s/r) where the spin creep kappa_s is not determined: over the
width of its prior that is far from a straight line, and an interval from first derivatives is too narrow on one side.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.settings.estimation import IdentifiabilitySettings
from railui.identification.context import Context
from railui.identification.estimation.block_products import scaled_inverse
from railui.identification.estimation.fit import Fit, NormalEquations
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.prediction import SimulationError

REACH = np.sqrt(3.0)  # of the outer points of the quadrature, in standard deviations
OUTER_WEIGHT = 1.0 / 6.0  # of each of the two outer points; the one in the middle has no spread


def with_spread_of_held_parameters(context: Context, fit: Fit) -> Fit:
    """Return a fit whose covariance has the spread over parameters that only a prior determines.

    The other estimates follow such a parameter to the ends of a three-point Gauss-Hermite quadrature, by one step of
    Gauss-Newton from the point that the covariance predicts. Their second moment about the estimate takes the place of
    the linear part of the covariance (Julier and Uhlmann, Proc. SPIE 3068 (1997) 182).
    """
    covariance = fit.covariance
    for j in held_parameters(fit, context.settings.identifiability):
        ends = [end for side in (-REACH, REACH) if (end := _estimates_along(context, fit, j, side)) is not None]
        if len(ends) < 2:
            continue
        moment = OUTER_WEIGHT * sum(np.outer(change, change) for change in ends)
        linear = np.outer(covariance[j], covariance[j]) / covariance[j, j]
        covariance = covariance - linear + moment
    return fit if covariance is fit.covariance else replace(fit, given_covariance=covariance)


def held_parameters(fit: Fit, settings: IdentifiabilitySettings) -> list[int]:
    """Indices of parameters that only a prior determines, and on which another estimate depends."""
    sd = np.maximum(fit.sd, 1e-300)
    correlation = np.abs(fit.covariance) / np.outer(sd, sd)
    is_held = sd > settings.unseen_prior_share * fit.free.prior_sd
    is_fixed = is_held | fit.free.are_on_bound(fit.x)
    limit = settings.held_correlation
    return [int(j) for j in np.flatnonzero(is_held) if np.any(correlation[j, ~is_fixed] > limit)]


def _estimates_along(context: Context, fit: Fit, j: int, reach: float) -> FloatArray | None:
    """Change [p] of all estimates where parameter j is so many standard deviations off; None where the fit fails."""
    optimiser = GaussNewton.of_fit(context.in_background(context.jobs), fit)
    center, free = fit.least_squares, ~fit.free.are_on_bound(fit.x)
    free[j] = False
    linear = reach * fit.covariance[j] / fit.sd[j]
    start = center + linear
    if np.any((start < fit.free.low) | (start > fit.free.high)):
        return None
    try:
        normal = optimiser.linearise(start)
    except SimulationError:
        return None
    step = _step(optimiser, normal, start, free) - _step(optimiser, fit.normal, center, free)
    tried = start + step
    if np.any((tried < fit.free.low) | (tried > fit.free.high)):
        return None
    misfits = optimiser.misfit(np.stack([start, tried]))
    return np.asarray(linear + step if misfits[1] < misfits[0] else linear)


def _step(optimiser: GaussNewton, normal: NormalEquations, x: FloatArray, free: NDArray[np.bool_]) -> FloatArray:
    """Step [p] of Gauss-Newton at x [p] in the free parameters [p]."""
    a, g = optimiser.equations(normal, x)
    step = np.zeros(len(x))
    step[free] = scaled_inverse(a[np.ix_(free, free)]) @ g[free]
    return step
