"""Broersen's own adjustment with two parallel models: one difference at a time.

Model 1 has the parameters as they stand, model 2 one of them a little changed, on the same track. With e the measured
less the simulated output and dw the difference of the two models, lambda = <e, dw>/<dw, dw> is how many of these little
changes explain the residual best (thesis chapter 5); rho = <e, dw>/sqrt(<e, e> <dw, dw>) says how well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.dataset import Dataset
from railui.identification.estimation.free_parameters import free_parameters
from railui.identification.estimation.output_error import Fit, GaussNewton, block_seconds
from railui.identification.estimation.problem import FitSegment
from railui.progress import Report, silent
from railui.vehicle.model import Model

LITTLE = 0.01  # of a parameter, the difference of model 2
SWEEPS = 25
CALM = 1e-3  # relative gain of a sweep below which the adjustment ends
HALVINGS = 3


@dataclass(frozen=True, eq=False)
class Correlations:
    """rho [path, channel] of the residual with the difference of two parallel models, and lambda [path] at the end."""

    paths: tuple[str, ...]
    channels: tuple[str, ...]
    rho: FloatArray
    steps: FloatArray


def two_parallel_models(
    model: Model,
    measurement: Dataset,
    paths: Sequence[str],
    declared: Model,
    ready: Sequence[FitSegment],
    *,
    jobs: int | None = None,
    report: Report = silent,
) -> tuple[Fit, Correlations]:
    """Adjust the numbers at `paths` one after the other, sweep after sweep, until a sweep gains nothing."""
    free = free_parameters(model, paths, declared)
    seconds = block_seconds(declared, [t.segment for t in ready])
    adjuster = GaussNewton(model, free, ready, block=seconds, stable=True, jobs=jobs)
    x = np.array([model.value(p) for p in free.paths])
    begun = adjuster.fit(x, tolerance=1e-3, most=0)
    adjuster.simulations = 0
    x, cost = begun.x, begun.cost
    sweep = 0
    for sweep in range(1, SWEEPS + 1):
        last = cost
        for j in range(len(x)):
            x, cost = _turned(adjuster, x, j, cost)
        report(f"  sweep {sweep}: misfit {np.exp((cost - begun.cost) / adjuster.independent_samples):.4f} of the first")
        if last - cost < CALM * adjuster.independent_samples:
            break
    spent = adjuster.simulations
    fit = adjuster.fit(x, tolerance=1e-3, most=0)
    return replace(fit, iterations=sweep, simulations=spent, status="converged"), residual_correlations(fit, jobs=jobs)


def _turned(adjuster: GaussNewton, x: FloatArray, j: int, cost: float) -> tuple[FloatArray, float]:
    """One parameter changed by lambda times its little difference, or less where that does not gain."""
    free = adjuster.free
    change = np.zeros_like(x)
    change[j] = LITTLE * max(abs(x[j]), 0.1 * free.size[j])
    products = np.zeros(3)
    for target in adjuster.segments:
        pair, lost = adjuster.simulate(target, np.vstack([x, x + change]))
        if np.any(lost >= 0):
            return x, cost
        dw, e = pair[1] - pair[0], target.measured - pair[0]
        products += np.array([np.sum(e * dw), np.sum(dw * dw), np.sum(e * e)])
    factor = adjuster.independent_samples / max(products[2], 1e-300)
    pull = change[j] * (free.prior[j] - x[j]) / free.prior_sd[j] ** 2
    step = (factor * products[0] + pull) / max(factor * products[1] + (change[j] / free.prior_sd[j]) ** 2, 1e-300)
    for _ in range(HALVINGS):
        tried = np.clip(x + step * change, free.low, free.high)
        there = float(adjuster.cost(adjuster.misfit(tried[None]), tried[None])[0])
        if there < cost:
            return tried, there
        step *= 0.5
    return x, cost


def residual_correlations(fit: Fit, *, jobs: int | None = None) -> Correlations:
    """rho per parameter and channel, and lambda: what the residual of a fit still asks of each parameter."""
    adjuster = GaussNewton(fit.model, fit.free, fit.segments, block=fit.block, stable=False, jobs=jobs)
    gram = adjuster.linearise(fit.x).gram.sum(axis=0)  # [channel, row, row]
    e, cross, own = gram[:, 0, 0], gram[:, 0, 1:], np.einsum("cii->ci", gram)[:, 1:]
    rho = cross / np.sqrt(np.maximum(e[:, None] * own, 1e-300))
    steps = cross.sum(axis=0) / np.maximum(own.sum(axis=0), 1e-300)
    return Correlations(fit.free.paths, tuple(fit.segments[0].segment.channels), np.asarray(rho.T), np.asarray(steps))
