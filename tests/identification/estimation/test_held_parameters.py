"""Spread of estimates over a parameter that a prior determines, against the combination that the data determine."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from railui.identification.context import Context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.held_parameters import (
    REACH,
    _outer_point,
    held_parameters,
    spread_along,
    whole_change,
    with_spread_of_held_parameters,
)
from railui.identification.estimation.unbiased import with_unbiased_estimates
from tests.blind.simulated import simulated_campaign

SPIN = "contact.spin_creep"
GRAVITATIONAL = "contact.leading.gravitational_stiffness"


@cache
def calibrated() -> tuple[Context, Fit]:
    context = simulated_campaign().context
    return context, calibrate(context)


def gravitational_stiffness(fit: Fit, spin: float) -> float:
    """Gravitational stiffness that leaves the lateral stiffness of (3.9) as it is, at another spin creep.

    2 N {epsilon - kappa_s (epsilon - sigma)/r}/b is what the lateral motion determines.
    """
    value = dict(zip(fit.free.paths, fit.x, strict=True))
    r = fit.model.value("vehicle.geometry.rolling_radius")
    epsilon, sigma = value[GRAVITATIONAL], value["contact.leading.roll"]
    stiffness = epsilon - value[SPIN] * (epsilon - sigma) / r
    return float((stiffness - spin * sigma / r) / (1.0 - spin / r))


def test_the_spin_creep_is_held_by_its_prior():
    context, fit = calibrated()
    assert [fit.free.paths[j] for j in held_parameters(fit, context.settings.identifiability)] == [SPIN]


@pytest.mark.filterwarnings("error")
def test_parameters_without_any_spread_are_correlated_with_none():
    context, fit = calibrated()
    settings = context.settings.identifiability
    fixed = [j for j in range(len(fit.x)) if j not in held_parameters(fit, settings)][:2]
    covariance = fit.covariance.copy()
    covariance[fixed], covariance[:, fixed] = 0.0, 0.0
    assert [fit.free.paths[j] for j in held_parameters(replace(fit, given_covariance=covariance), settings)] == [SPIN]


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_gravitational_stiffness_follows_the_spin_creep_as_the_equation_of_motion_says(side: float):
    context, fit = calibrated()
    j, i = fit.free.paths.index(SPIN), fit.free.paths.index(GRAVITATIONAL)
    reach = side * REACH * fit.sd[j]
    point = _outer_point(context, fit, j, side * REACH)
    assert point is not None
    change = point.change / point.share
    assert change[j] == pytest.approx(reach)
    expected = gravitational_stiffness(fit, fit.x[j] + reach) - fit.x[i]
    linear = reach * fit.covariance[i, j] / fit.covariance[j, j]
    assert abs(change[i] - expected) < 0.25 * abs(linear - expected)


def test_the_spread_is_the_second_moment_over_the_width_of_the_prior():
    context, fit = calibrated()
    wide = with_spread_of_held_parameters(context, fit)
    j, i = fit.free.paths.index(SPIN), fit.free.paths.index(GRAVITATIONAL)
    ends = [gravitational_stiffness(fit, fit.x[j] + side * REACH * fit.sd[j]) - fit.x[i] for side in (-1.0, 1.0)]
    moment = sum(change**2 for change in ends) / 6.0  # three-point Gauss-Hermite quadrature
    alone = fit.covariance[i, i] - fit.covariance[i, j] ** 2 / fit.covariance[j, j]
    assert wide.sd[i] == pytest.approx(np.sqrt(alone + moment), rel=0.15)
    assert wide.sd[i] > 1.1 * fit.sd[i]
    assert wide.sd[j] == pytest.approx(fit.sd[j])


def test_a_point_that_is_extrapolated_stays_within_the_bounds():
    context, fit = calibrated()
    wide = with_spread_of_held_parameters(context, fit)
    i, point = fit.free.paths.index(GRAVITATIONAL), wide.held_points[-1]
    near = replace(point, share=0.25 * point.share)  # as if the change had been reached at a quarter of the distance
    assert point.change[i] / near.share > fit.x[i]
    bounded = replace(fit, free=replace(fit.free, high=np.where(np.arange(len(fit.x)) == i, 2.0 * fit.x[i], np.inf)))
    assert whole_change(bounded, near)[i] == pytest.approx(fit.x[i])
    assert spread_along(bounded, [near])[i, i] == pytest.approx(fit.x[i] ** 2 / 3.0)


def test_the_last_step_leaves_a_held_parameter_and_the_misfit():
    """Along the first derivatives it would leave the curve on which the data determine the others."""
    context, fit = calibrated()
    last = with_unbiased_estimates(context, fit)
    assert np.any(last.shift) and last.shift[fit.free.paths.index(SPIN)] == 0.0
    before, after = GaussNewton.of_fit(context, fit).misfit(np.stack([fit.x, last.x]))
    assert after < 1.005 * before
