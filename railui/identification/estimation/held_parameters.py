"""Spread of estimates that follow a parameter which only a prior determines, beyond the linear covariance.

The data often determine a combination of parameters only. A lateral stiffness of the contact, epsilon (1 - kappa_s/r),
leaves the gravitational stiffness epsilon as 1/(1 - kappa_s/r) where the spin creep kappa_s is not determined: over the
width of its prior that is far from a straight line, and an interval from first derivatives is too narrow on one side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.settings.estimation import IdentifiabilitySettings
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit, HeldPoint
from railui.identification.estimation.fixed_parameter import fit_with_parameter_fixed
from railui.identification.prediction import SimulationError
from railui.parallel import map_threads
from railui.vehicle.sampling import covariance_root

REACH = np.sqrt(3.0)  # of the outer points of the quadrature, in standard deviations
OUTER_WEIGHT = 1.0 / 6.0  # of each of the two outer points; the one in the middle has no spread
NEARER = (1.0, 0.5, 0.25)  # shares of that reach, tried in turn
MAX_MISFIT_RISE = 0.005  # relative, of the estimates at an outer point: beyond, the data determine the parameter there
TOLERANCE, MAX_ITERATIONS = 1e-3, 5  # of these estimates


def with_spread_of_held_parameters(context: Context, fit: Fit) -> Fit:
    """Return a fit whose covariance has the spread over parameters that only a prior determines.

    At the outer points of a three-point Gauss-Hermite quadrature over such a parameter the others are estimated again.
    Their second moment about the estimate takes the place of the linear part of the covariance (Julier and Uhlmann,
    Proc. SPIE 3068 (1997) 182). The change up to a nearer point counts in proportion to the distance, within the bounds
    of the estimates, a point that cannot be reached as the mirror image of the other.
    """
    held = held_parameters(fit, context.settings.identifiability)
    background = context.in_background(1)

    def point_at(task: tuple[int, float]) -> HeldPoint | None:
        return _outer_point(background, fit, *task)

    found = map_threads(point_at, [(j, side * REACH) for j in held for side in (-1.0, 1.0)], context.jobs)
    points = tuple(point for point in found if point is not None)
    covariance = fit.covariance
    for j in sorted({point.index for point in points}):
        covariance = covariance - np.outer(fit.covariance[j], fit.covariance[j]) / fit.covariance[j, j]
    root = covariance_root(covariance + spread_along(fit, points))  # the difference may be slightly indefinite
    return replace(fit, given_covariance=root @ root.T, held_points=points) if points else fit


def spread_along(fit: Fit, points: Sequence[HeldPoint]) -> FloatArray:
    """Second moment [p, p] of the estimates over the parameters that only a prior determines."""
    moment = np.zeros((len(fit.x), len(fit.x)))
    for j in sorted({point.index for point in points}):
        changes = [whole_change(fit, point) for point in points if point.index == j]
        moment += 2.0 * OUTER_WEIGHT * np.mean([np.outer(change, change) for change in changes], axis=0)
    return moment


def whole_change(fit: Fit, point: HeldPoint) -> FloatArray:
    """Change [p] of the estimates at the whole distance of a point, in proportion and within their bounds."""
    center, free = fit.least_squares, fit.free
    return np.clip(point.change / point.share, free.low - center, free.high - center)


def held_parameters(fit: Fit, settings: IdentifiabilitySettings) -> list[int]:
    """Indices of parameters that only a prior determines, and on which another estimate depends."""
    sd = np.maximum(fit.sd, 1e-150)  # its square is no zero
    correlation = np.abs(fit.covariance) / np.outer(sd, sd)
    is_held = sd > settings.unseen_prior_share * fit.free.prior_sd
    is_fixed = is_held | fit.free.are_on_bound(fit.x)
    limit = settings.held_correlation
    return [int(j) for j in np.flatnonzero(is_held) if np.any(correlation[j, ~is_fixed] > limit)]


def _outer_point(context: Context, fit: Fit, j: int, reach: float) -> HeldPoint | None:
    """Estimate all others with parameter j so many standard deviations off; None where the misfit rises.

    Where a bound is nearer, or the misfit rises, a nearer point is taken.
    """
    center, sd = fit.least_squares, fit.sd[j]
    for part in NEARER:
        value = float(np.clip(center[j] + part * reach * sd, fit.free.low[j], fit.free.high[j]))
        share = (value - center[j]) / (reach * sd)
        if share <= 0.0:
            return None
        try:
            refit = fit_with_parameter_fixed(context, fit, j, value, tolerance=TOLERANCE, max_iterations=MAX_ITERATIONS)
        except SimulationError:  # the vehicle diverges
            continue
        if refit.normal.rss <= (1.0 + MAX_MISFIT_RISE) * fit.normal.rss:
            return HeldPoint(j, share, np.insert(refit.x, j, value) - center)
    return None
