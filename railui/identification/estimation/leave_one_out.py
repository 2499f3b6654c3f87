"""Leave-one-run-out errors: each run predicted with the parameters estimated on all others, to first order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.comparison import compared_channels
from railui.identification.context import Context
from railui.identification.estimation.block_products import scaled_inverse
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.prediction import DivergedError

MIN_RUNS = 3
CUTOFF = 1e-9  # of the scaled normal matrix


@dataclass(frozen=True)
class LeftOutRun:
    """NRMSE of a run with the parameters estimated on all other runs, and with those estimated on all runs.

    nrmse: None where the run responds so much to the change of the parameters that first order does not hold.
    """

    file: str
    role: str
    nrmse: float | None
    nrmse_with_all: float


def leave_one_run_out(context: Context, fit: Fit, validation_fit: Fit | None) -> list[LeftOutRun]:
    """Estimate the parameters without each run in turn, by one step from the calibrated model.

    Parameters
    ----------
    fit
        The final model on the estimation runs.
    validation_fit
        That model prepared on the validation runs; None where it hunts there.

    Returns
    -------
    list of LeftOutRun
        One per estimation and validation run; empty with fewer than three runs, runs of different channels, windows,
        phases of rotating parts, or where a simulation diverges.
    """
    if validation_fit is None or any(t.is_window for t in fit.segments):
        return []
    segments = [*fit.segments, *validation_fit.segments]
    runs = list(dict.fromkeys(t.segment.run_index for t in segments))
    channels = [tuple(t.segment.channels) for t in segments]
    if len(runs) < MIN_RUNS or len(set(channels)) > 1 or any("@" in p for p in fit.free.paths):
        return []
    optimiser = GaussNewton.of_fit(context.in_background(context.jobs), fit, segments)
    size, count = 1 + len(fit.x), len(channels[0])
    grams = {run: np.zeros((count, size, size)) for run in runs}
    power = {run: np.zeros(count) for run in runs}
    try:
        optimiser.restart_windows(fit.x)  # a rig starts as freely on a validation run as on those of the fit
        simulated = [optimiser.sensitivities(t, fit.x).converged() for t in optimiser.segments]
    except DivergedError:
        return []
    for t, series in zip(optimiser.segments, simulated, strict=True):
        grams[t.segment.run_index] += np.einsum("icn,jcn->cij", series, series, optimize=True)
        power[t.segment.run_index] += np.sum(t.measured**2, axis=1)
    used = [channels[0].index(c) for c in compared_channels(segments[0].segment)]
    total = np.sum(list(grams.values()), axis=0)
    rows = []
    for run in runs:
        first = next(t.segment for t in segments if t.segment.run_index == run)
        own, scale = grams[run][used], power[run][used]
        without, with_all = (change_of_estimates(fit, g.sum(axis=0), fit.x) for g in (total - grams[run], total))
        error = left_out_error(own, scale, without, context.settings.validation.max_first_order_change)
        rows.append(LeftOutRun(first.file, first.role, error, _nrmse(own, scale, with_all)))
    return rows


def change_of_estimates(fit: Fit, gram: FloatArray, x: FloatArray) -> FloatArray:
    """Change [p] of estimates x [p] of a fit by which they follow other data, to first order.

    gram: products [1 + p, 1 + p] of the residual at x and its sensitivities in these data. The priors keep their means:
    they pull the estimates back as they did in the fit.
    """
    precision = fit.normal.variance / fit.free.prior_sd**2
    inverse = scaled_inverse(gram[1:, 1:] + np.diag(precision), CUTOFF)
    return np.asarray(inverse @ (gram[1:, 0] + precision * (fit.free.prior - x)))


def left_out_error(grams: FloatArray, power: FloatArray, step: FloatArray, max_change: float) -> float | None:
    """NRMSE of a run after a change of the parameters [p], to first order; None where its response changes by more.

    Parameters
    ----------
    grams
        Products [channel, 1 + p, 1 + p] of the residual and its sensitivities.
    power
        Squared measured response [channel].
    max_change
        Rms change of the response over its rms.
    """
    squares = np.einsum("i,cij,j->c", step, grams[:, 1:, 1:], step)
    change = np.sqrt(np.mean(np.maximum(squares, 0.0) / np.maximum(power, 1e-300)))
    return _nrmse(grams, power, step) if change <= max_change else None


def _nrmse(grams: FloatArray, power: FloatArray, step: FloatArray) -> float:
    """NRMSE of inner products [channel, 1 + p, 1 + p] after a change of the parameters [p]."""
    weights = np.concatenate([[1.0], -step])
    squares = np.einsum("i,cij,j->c", weights, grams, weights)
    return float(np.sqrt(np.mean(np.maximum(squares, 0.0) / np.maximum(power, 1e-300))))
