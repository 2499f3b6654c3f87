"""Quick path: one new run linearised about the calibrated model of its vehicle, without a loop.

A few Gauss-Newton steps from the reference, and one small amount of every watched effect. Parameters and amounts follow
from inner products alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy import linalg

from railui.arrays import FloatArray
from railui.campaign.comparison import comparison_filter, kernel_filter
from railui.campaign.segment import Segment
from railui.campaign.settings.fleet import FleetSettings
from railui.fleet.fleet_file import Vehicle
from railui.fleet.reference import Reference, reference_context
from railui.fleet.summary import RunSummary
from railui.identification.context import Context
from railui.identification.estimation.block_products import scaled_inverse
from railui.identification.estimation.fit import residual_variance
from railui.identification.estimation.free_parameters import FreeParameters, free_parameters
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.initial_state import estimate_initial_state
from railui.identification.estimation.problem import FitSegment, required_fit_steps
from railui.identification.structure.candidates import Candidate, batch_candidates, is_compatible
from railui.identification.structure.score_test import output_differences
from railui.vehicle.model import Model

MAX_ITERATIONS: Final = 6
STEP_SHARES: Final = (1.0, 0.6, 0.3, 0.1)
MIN_GAIN: Final = 1e-4  # of the misfit, below which the iteration ends
MIN_PRIOR_SIZE: Final = 0.05  # of the usual size, of a parameter whose reference is about zero


@dataclass(frozen=True)
class Watch:
    """Effects whose size is followed, with the names of their quantities."""

    candidates: tuple[Candidate, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects, such as "free_play at primary_lateral 1"."""
        return tuple(direction_name(c) for c in self.candidates)


def direction_name(candidate: Candidate) -> str:
    """Return the name of an effect as a quantity."""
    return f"{candidate.kind} at {candidate.at}" + (f" {candidate.wheelset}" if candidate.wheelset else "")


def summarise_run(
    vehicle: Vehicle, reference: Reference, watch: Watch, settings: FleetSettings, segment: Segment
) -> RunSummary:
    """Linearise a run about its own estimate and summarise it.

    Raises
    ------
    ValueError
        Where the vehicle diverges, or the run has other channels than the reference.
    """
    if tuple(segment.channels) != reference.channels:
        raise ValueError(
            f"has the channels {', '.join(segment.channels)}, the reference {', '.join(reference.channels)}"
        )
    context, model = reference_context(vehicle, reference, segment)
    free = _free_parameters(context, model, reference, settings)
    target = _target(context, model, segment, reference.weights)
    x, rows, target = _gauss_newton(context, model, free, target, reference.x)
    found = model.with_path_values(reference.paths, x)
    differences = _differences(context, found, target, watch.candidates)
    stacked = np.concatenate([rows, target.without_initial_state(differences)])
    flat = stacked.reshape(len(stacked), -1)
    return _summary(context, free, target, x, flat @ flat.T, stacked[0], watch.names)


def _free_parameters(context: Context, model: Model, reference: Reference, settings: FleetSettings) -> FreeParameters:
    """Parameters with a wide prior about the reference, which bounds what one run cannot determine."""
    free = free_parameters(context, model, list(reference.paths))
    usual = np.where(np.isfinite(free.size), free.size, 1.0)
    width = settings.run_prior_share * np.maximum(np.abs(reference.x), MIN_PRIOR_SIZE * usual)
    return replace(free, prior=reference.x, prior_sd=np.minimum(width, free.prior_sd))


def _target(context: Context, model: Model, segment: Segment, weights: FloatArray) -> FitSegment:
    """Prepare a run for the fit with the weights of the reference; every sample in the band is compared."""
    campaign = context.campaign
    measured = comparison_filter(campaign, segment, segment.measured(segment.channels)) * weights[:, None]
    start = estimate_initial_state(context, model, segment)
    kernel = kernel_filter(campaign, segment, weights)
    return FitSegment(segment, kernel, measured, start, *required_fit_steps(context, model, segment))


def _gauss_newton(
    context: Context, model: Model, free: FreeParameters, target: FitSegment, x: FloatArray
) -> tuple[FloatArray, FloatArray, FitSegment]:
    """Estimate x [p]; return it with residual and sensitivities [1 + p, channel, n] and the prepared run."""
    solver = GaussNewton(context, model, free, [target])
    rows = _linearise(solver, x)
    share, count = context.settings.calibration.independent_sample_share, target.measured.size
    for _ in range(MAX_ITERATIONS):
        flat = rows.reshape(len(rows), -1)
        misfit = float(flat[0] @ flat[0])
        precision = np.diag(residual_variance(misfit, count, share) / free.prior_sd**2)
        step = _solve(flat[1:] @ flat[1:].T + precision, flat[1:] @ flat[0] + precision @ (free.prior - x))
        tried = np.clip(x + np.outer(STEP_SHARES, step), free.low, free.high)
        misfits = solver.misfit(tried)
        best = int(np.argmin(misfits))
        if not misfits[best] < (1.0 - MIN_GAIN) * misfit:
            break
        x = tried[best]
        rows = _linearise(solver, x)
    return x, rows, solver.segments[0]


def _linearise(solver: GaussNewton, x: FloatArray) -> FloatArray:
    """Residual and sensitivities [1 + p, channel, n] at x, the initial state of a rig estimated there."""
    solver.restart_windows(x)
    rows, diverged = solver.sensitivities(solver.segments[0], x)
    if np.any(diverged >= 0):
        raise ValueError(f"the vehicle diverges on {solver.segments[0].segment.file}")
    return rows


def _solve(a: FloatArray, b: FloatArray) -> FloatArray:
    """Solve symmetric equations whose unknowns have very different sizes."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(a), 1e-300))
    return np.asarray(scale * (linalg.pinvh(a * np.outer(scale, scale)) @ (b * scale)))


def _differences(context: Context, model: Model, target: FitSegment, candidates: Sequence[Candidate]) -> FloatArray:
    """Output differences per amount [k, channel, n] in the order of the candidates; zero where not valid.

    An effect that the model has already, which a loop of its vehicle added, is none that could appear.
    """
    series = np.zeros((len(candidates), *target.measured.shape))
    for batch in batch_candidates([c for c in candidates if is_compatible(model, c)]):
        found, _ = output_differences(context.settings, model, target, batch)
        for lane, (member, _) in enumerate(batch.lanes):
            series[candidates.index(batch.members[member])] = found[lane]
    return series


def _summary(
    context: Context,
    free: FreeParameters,
    target: FitSegment,
    x: FloatArray,
    gram: FloatArray,
    residual: FloatArray,
    names: tuple[str, ...],
) -> RunSummary:
    share, segment = context.settings.calibration.independent_sample_share, target.segment
    variance = residual_variance(float(gram[0, 0]), target.measured.size, share)
    estimate, sd, determined = estimates_of_gram(gram, x, free.prior, free.prior_sd, variance)
    on_rig = segment.is_rig
    return RunSummary(
        tuple(free.paths),
        names,
        tuple(segment.channels),
        x,
        gram,
        estimate,
        sd,
        determined,
        np.sqrt(np.mean(residual**2, axis=1)),
        variance,
        float(target.measured.size),
        float("nan") if on_rig else segment.mean_speed,
        float("nan") if on_rig else float(segment.columns["s"][0]),
        segment.samples * segment.dt,
    )


def estimates_of_gram(
    gram: FloatArray, x: FloatArray, prior: FloatArray, prior_sd: FloatArray, variance: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Estimate parameters and effects from inner products.

    Parameters
    ----------
    gram : array [1 + p + k, 1 + p + k]
    x, prior, prior_sd : array [p]
        Point of linearisation, mean and standard deviation of the prior.
    variance : float
        Squared residual per independent sample.

    Returns
    -------
    tuple of array [p + k]
        Estimates, standard deviations, and determined shares: see `RunSummary`.

    Notes
    -----
    With A = S'S + P the parameters are x + A^-1 (S'r + P (m - x)), the amount of an effect with difference d is
    (d'r - d'S A^-1 S'r) / n, n = d'd - d'S A^-1 S'd.
    """
    p = len(x)
    precision = variance / prior_sd**2
    a = gram[1 : 1 + p, 1 : 1 + p] + np.diag(precision)
    inverse = scaled_inverse(a)
    step = inverse @ (gram[1 : 1 + p, 0] + precision * (prior - x))
    covariance = variance * np.diag(inverse)
    absorbed = gram[1 + p :, 1 : 1 + p] @ inverse
    lengths = np.diag(gram)[1 + p :]
    norm = lengths - np.einsum("kp,kp->k", absorbed, gram[1 + p :, 1 : 1 + p])
    share = np.where(lengths > 0.0, norm / np.maximum(lengths, 1e-300), 0.0)
    safe = np.where(share > 1e-9, norm, np.inf)
    amounts = (gram[1 + p :, 0] - gram[1 + p :, 1 : 1 + p] @ step) / safe
    return (
        np.concatenate([x + step, amounts]),
        np.sqrt(np.concatenate([covariance, variance / safe])),
        np.concatenate([1.0 - covariance / prior_sd**2, share]),
    )
