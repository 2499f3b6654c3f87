"""Broersen's method of two parallel models: one parameter difference at a time.

Model 1 has the parameters as they are, model 2 one of them slightly changed, on the same track. With e the measured
less the simulated output and dw the difference of the two models, lambda = <e, dw>/<dw, dw> is the number of these
small changes that explains the residual best (thesis chapter 5); rho = <e, dw>/sqrt(<e, e> <dw, dw>) measures how well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from railui.arrays import FloatArray
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit, block_duration
from railui.identification.estimation.free_parameters import free_parameters
from railui.identification.estimation.gauss_newton import MIN_STEP_SIZE_SHARE, GaussNewton
from railui.identification.estimation.problem import FitSegment
from railui.vehicle.model import Model

RELATIVE_DIFFERENCE = 0.01  # of a parameter between the two models
MAX_SWEEPS = 25
MIN_SWEEP_GAIN = 1e-3  # relative gain of a sweep below which the fit ends
STEP_HALVINGS = 3
TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class Correlations:
    """rho [path, channel] of the residual with the difference of two parallel models, and lambda [path] at the end."""

    paths: tuple[str, ...]
    channels: tuple[str, ...]
    rho: FloatArray
    steps: FloatArray


def two_parallel_models(context: Context, model: Model, segments: Sequence[FitSegment]) -> Fit:
    """Estimate the campaign's parameters one after the other, sweep after sweep, until a sweep gains nothing."""
    free = free_parameters(context, model, context.campaign.estimated_parameters)
    duration = block_duration(context.settings.calibration, context.nominal, [t.segment for t in segments])
    quiet = context.in_background(context.jobs)
    stable = not model.limits_hunting
    optimiser = GaussNewton(quiet, model, free, segments, block=duration, stable=stable)
    x = np.array([model.value(p) for p in free.paths])
    first = optimiser.fit(x, tolerance=TOLERANCE, max_iterations=0)
    optimiser.simulations = 0
    x, cost = first.x, first.cost
    sweep, status = 0, "iterations"
    for sweep in range(1, MAX_SWEEPS + 1):
        last = cost
        for j in range(len(x)):
            x, cost = _step(optimiser, x, j, cost)
        misfit = np.exp((cost - first.cost) / optimiser.independent_samples)
        context.progress.message(f"  sweep {sweep}: misfit {misfit:.4f} of the first")
        if last - cost < MIN_SWEEP_GAIN * optimiser.independent_samples:
            status = "converged"
            break
    spent = optimiser.simulations
    fit = optimiser.fit(x, tolerance=TOLERANCE, max_iterations=0)
    return replace(fit, iterations=sweep, simulations=spent, status=status)


def _step(optimiser: GaussNewton, x: FloatArray, j: int, cost: float) -> tuple[FloatArray, float]:
    """Change one parameter by lambda times its small difference, or by less where that gains nothing."""
    free = optimiser.free
    change = np.zeros_like(x)
    change[j] = RELATIVE_DIFFERENCE * max(abs(x[j]), MIN_STEP_SIZE_SHARE * free.size[j])
    products = np.zeros(3)
    for target in optimiser.segments:
        optimiser.simulations += 2
        pair, diverged = optimiser.simulate(target, np.vstack([x, x + change]))
        if np.any(diverged >= 0):
            return x, cost
        dw, e = target.without_initial_state(np.stack([pair[1] - pair[0], target.measured - pair[0]]))
        products += np.array([np.sum(e * dw), np.sum(dw * dw), np.sum(e * e)])
    factor = optimiser.independent_samples / max(products[2], 1e-300)
    prior = change[j] * (free.prior[j] - x[j]) / free.prior_sd[j] ** 2
    step = (factor * products[0] + prior) / max(factor * products[1] + (change[j] / free.prior_sd[j]) ** 2, 1e-300)
    for _ in range(STEP_HALVINGS):
        tried = np.clip(x + step * change, free.low, free.high)
        tried_cost = float(optimiser.cost(optimiser.misfit(tried[None]), tried[None])[0])
        if tried_cost < cost:
            return tried, tried_cost
        step *= 0.5
    return x, cost


def residual_correlations(context: Context, fit: Fit) -> Correlations:
    """Compute rho per parameter and channel, and lambda, of the residual of a fit."""
    quiet = context.in_background(context.jobs)
    optimiser = GaussNewton.of_fit(quiet, fit)
    gram = optimiser.linearise(fit.x).gram.sum(axis=0)  # [channel, row, row]
    error, cross, squares = gram[:, 0, 0], gram[:, 0, 1:], np.einsum("cii->ci", gram)[:, 1:]
    rho = cross / np.sqrt(np.maximum(error[:, None] * squares, 1e-300))
    steps = cross.sum(axis=0) / np.maximum(squares.sum(axis=0), 1e-300)
    return Correlations(fit.free.paths, tuple(optimiser.channels), np.asarray(rho.T), np.asarray(steps))
