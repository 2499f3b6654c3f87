"""Samples of the estimates: misfit, spread, and the curve along which a held parameter moves the others."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.held_parameters import spread_along, with_spread_of_held_parameters
from railui.identification.estimation.parameter_samples import _moves, with_parameter_samples
from railui.vehicle.sampling import covariance_root
from tests.identification.estimation.test_held_parameters import (
    GRAVITATIONAL,
    SPIN,
    calibrated,
    gravitational_stiffness,
)


@cache
def sampled() -> Fit:
    context, fit = calibrated()
    return with_parameter_samples(context, with_spread_of_held_parameters(context, fit))


def misfit_rise(fit: Fit, deviations: np.ndarray) -> np.ndarray:
    """Rise of the misfit on the estimation runs, relative to that of the fit."""
    points = np.clip(fit.x + deviations, fit.free.low, fit.free.high)
    misfit = GaussNewton.of_fit(calibrated()[0], fit).misfit(np.vstack([fit.x, points]))
    return misfit[1:] / misfit[0] - 1.0


def test_samples_reproduce_the_measured_motions_where_a_normal_distribution_does_not():
    fit = sampled()
    assert len(fit.samples) == calibrated()[0].settings.calibration.parameter_samples
    normal = np.random.default_rng(1).standard_normal((64, len(fit.x))) @ covariance_root(fit.covariance).T
    assert np.max(misfit_rise(fit, fit.samples)) < 0.1
    assert np.quantile(misfit_rise(fit, normal), 0.9) > 0.5


def test_samples_have_the_spread_of_the_estimates():
    fit = sampled()
    spread = np.sqrt(np.mean(fit.samples**2, axis=0)) / fit.sd
    assert np.all(spread > 0.93) and np.all(spread < 1.07) and 0.97 < np.median(spread) < 1.03


def test_moves_of_held_parameters_have_the_second_moment_that_the_covariance_has():
    """Also where a refit reached half the distance only, and where the mirror image of a point cannot be reached."""
    fit = sampled()
    far, near = fit.held_points
    count, p = 60, len(fit.x)
    chance = np.tile((np.arange(count)[:, None] + 0.5) / count, p)
    for points in ((far, near), (far,), (far, replace(near, share=0.5 * near.share, change=0.5 * near.change))):
        partly = replace(fit, held_points=points)
        whole, reached, single = _moves(partly, chance)
        np.testing.assert_allclose(whole.change.T @ whole.change / count, spread_along(partly, points), rtol=1e-9)
        assert np.flatnonzero(whole.is_moved.any(axis=0)).tolist() == [far.index] and whole.is_moved.sum() == 20
        assert np.array_equal(reached.change, single.change)


def test_samples_follow_the_curve_of_a_held_parameter():
    """The gravitational stiffness stays where the lateral stiffness of (3.9) is the same at the sample's spin creep."""
    fit = sampled()
    i, j = fit.free.paths.index(GRAVITATIONAL), fit.free.paths.index(SPIN)
    at_ends = fit.samples[np.abs(fit.samples[:, j]) > fit.sd[j]]
    assert len(at_ends) > 10
    expected = np.array([gravitational_stiffness(fit, fit.x[j] + one[j]) - fit.x[i] for one in at_ends])
    assert np.median(np.abs(at_ends[:, i] - expected)) < 0.2 * np.median(np.abs(expected))


def test_samples_do_not_depend_on_the_number_of_threads():
    context, fit = calibrated()
    assert np.array_equal(
        with_parameter_samples(context.in_background(1), fit).samples,
        with_parameter_samples(context.in_background(2), fit).samples,
    )
