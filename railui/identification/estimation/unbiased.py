"""Last step of an estimation: bias from noise of the recorded track, and the spread of the initial states."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.identification.context import Context
from railui.identification.estimation.block_products import block_gram
from railui.identification.estimation.covariance import block_covariance
from railui.identification.estimation.fit import Fit, residual_variance
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.held_parameters import held_parameters
from railui.identification.estimation.initial_state import state_on_rails, state_scale
from railui.identification.estimation.problem import FitSegment, sensitivities_to_start
from railui.identification.prediction import DivergedError
from railui.parallel import map_threads

BIAS_SEED = 17
MIN_REALISATIONS = 2  # one has no spread


@dataclass(frozen=True, eq=False)
class _Joint:
    """Products [block, 1 + p + q, 1 + p + q] with the q initial states; precision, gradient [p + q] of priors."""

    blocks: FloatArray
    precision: FloatArray
    variance: float
    gradient: FloatArray

    def solve(self, scores: FloatArray, free: FloatArray) -> FloatArray:
        """Change [p + q] of the free numbers that scores [p + q] ask for."""
        a = self.blocks.sum(axis=0)[1:, 1:] + self.variance * np.diag(self.precision)
        index = np.flatnonzero(free)
        a = a[np.ix_(index, index)]
        scale = 1.0 / np.sqrt(np.maximum(np.diag(a), 1e-300))
        change = np.zeros(len(free))
        change[index] = scale * (np.linalg.pinv(a * np.outer(scale, scale), hermitian=True) @ (scale * scores[index]))
        return change


def with_unbiased_estimates(context: Context, fit: Fit) -> Fit:
    """Return a fit after its last step: with the initial states free, and without the bias from track noise.

    Least squares on a recorded track prefers parameters with which the vehicle follows the noise of the record less.
    The expected shift follows from simulations of the calibrated vehicle on its own track with added noise, and is
    subtracted (corrected score: Nakamura, Biometrika 77 (1990) 127). A parameter that only a prior determines is left
    where it is: along it the others follow a curve, not the first derivatives. Where the corrected vehicle fits clearly
    worse than it should, or is not stable, the estimates stay and the shift adds to their standard deviations.
    """
    background = context.in_background(context.jobs)
    optimiser = GaussNewton.of_fit(background, fit)
    joint = _joint_products(context, fit, optimiser)
    p = len(fit.x)
    is_fixed = fit.free.are_on_bound(fit.x)
    is_fixed[held_parameters(fit, context.settings.identifiability)] = True
    free = np.concatenate([~is_fixed, np.ones(len(joint.precision) - p, dtype=bool)])
    step = joint.solve(joint.blocks.sum(axis=0)[1:, 0] + joint.variance * joint.gradient, free)
    scores = track_noise_scores(context, fit, optimiser)
    of_states = np.zeros(len(free) - p)
    bias = joint.solve(np.concatenate([scores.mean, of_states]), free)[:p]
    errors = np.array([joint.solve(np.concatenate([d, of_states]), free)[:p] for d in scores.deviations])
    residual = np.concatenate([[1.0], -step])
    blocks = joint.blocks.copy()
    blocks[:, 1:, 0] = joint.blocks[:, 1:, :] @ residual
    covariance = block_covariance(blocks, joint.precision, joint.variance)[:p, :p] + errors.T @ errors
    shift = step[:p] - bias
    x = np.clip(fit.x + shift, fit.free.low, fit.free.high)
    model = fit.model.with_path_values(fit.free.paths, x)
    last = replace(fit, model=model, x=x, given_covariance=covariance, shift=x - fit.x)
    if not _is_as_good(context, fit, x):
        return with_shift_as_spread(fit, last)
    of_level = 2.0 * _log_sd_of_track_noise(context, fit) * bias  # the bias grows as the squared level
    return replace(last, given_covariance=covariance + np.outer(of_level, of_level))


def _log_sd_of_track_noise(context: Context, fit: Fit) -> float:
    """Standard deviation of the logarithm of the level of the inputs' noise: one factor for all columns."""
    columns = {c for t in fit.segments for c in t.segment.input_columns if context.noise.get(c)}
    return max(map(context.noise.log_sd, columns), default=0.0)


def with_shift_as_spread(fit: Fit, last: Fit) -> Fit:
    """Return a fit with the covariance of its last step, to which the shift that was not made is added."""
    covariance = last.covariance + np.outer(last.shift, last.shift)
    return replace(fit, given_covariance=covariance, held_points=last.held_points)


def _is_as_good(context: Context, fit: Fit, x: FloatArray) -> bool:
    """True where a shifted estimate fits about as well, and its vehicle may be simulated."""
    bounded = fit.model.limits_hunting or any(t.is_window for t in fit.segments)
    stable = fit.model.design.is_on_track and not bounded
    optimiser = GaussNewton.of_fit(context.in_background(1), fit, stable=stable)
    misfits = optimiser.misfit(np.stack([fit.x, x]))
    limit = (1.0 + context.settings.calibration.bias_misfit_share) * misfits[0]
    return bool(np.isfinite(misfits[1]) and misfits[1] <= limit)


class NoiseScores(NamedTuple):
    """Mean score [p] over realisations of noise, and deviations [k, p] whose squares are its variance."""

    mean: FloatArray
    deviations: FloatArray


def track_noise_scores(context: Context, fit: Fit, optimiser: GaussNewton) -> NoiseScores:
    """Return the score that noise of the recorded track is expected to give where the model is true.

    With the response f(y) to a track y and its sensitivities S(y), a record y + n of the true track y gives
    S(y + n)' (f(y) - f(y + n)). The mean over n and -n is free of what is odd in n. Realisations on which the vehicle
    diverges are left out; zeros where fewer than two of a segment remain, whose spread is unknown.
    """
    noise, draws = context.noise, context.settings.calibration.bias_draws
    none = NoiseScores(np.zeros(len(fit.x)), np.zeros((0, len(fit.x))))
    if not any(noise.get(c) for t in fit.segments for c in t.segment.input_columns):
        return none
    spacing = fit.model.wheelset_spacing()

    segments = [t.for_differences for t in optimiser.segments]
    exact = list(map_threads(lambda t: optimiser.simulate(t, fit.x[None]).converged()[0], segments, context.jobs))

    def score(task: tuple[int, int]) -> FloatArray:
        index, draw = task
        target = segments[index]
        segment = target.segment
        rng = np.random.default_rng(np.random.SeedSequence([BIAS_SEED, draw, segment.number, segment.run_index]))
        table = segment.table(spacing, target.steps)
        noisy = segment.noisy_table(noise, context.campaign.noise_band, rng, spacing, target.steps)
        total = np.zeros(len(fit.x))
        for other in (noisy, 2.0 * table - noisy):
            series, diverged = optimiser.sensitivities(target, fit.x, other)
            if np.any(diverged >= 0):
                return np.full(len(fit.x), np.nan)
            # the residual of the measurement on this track, less that on the recorded one
            difference = series[0] - target.without_initial_state(target.measured - exact[index])
            total += 0.5 * np.tensordot(series[1:], difference, 2)
        return np.asarray(total)

    tasks = list(product(range(len(segments)), range(draws)))
    scores = np.reshape(list(map_threads(score, tasks, context.jobs)), (len(segments), draws, -1))
    is_valid = np.isfinite(scores).all(axis=2)
    if is_valid.sum(axis=1).min() < MIN_REALISATIONS:
        context.progress.message("the vehicle diverges on track with noise: no bias is subtracted from the estimates")
        return none
    known = [one[valid] for one, valid in zip(scores, is_valid, strict=True)]
    deviations = [(x - x.mean(axis=0)) / np.sqrt(len(x) * (len(x) - 1)) for x in known]
    return NoiseScores(np.sum([x.mean(axis=0) for x in known], axis=0), np.concatenate(deviations))


def _joint_products(context: Context, fit: Fit, optimiser: GaussNewton) -> _Joint:
    """Products of residual, sensitivities and sensitivities to the initial states of full segments."""
    optimiser.restart_windows(fit.x)
    states = [_initial_state_sensitivities(context, fit, t) for t in optimiser.segments]
    p, q = len(fit.x), sum(len(rows) for rows, _ in states)
    grams, samples, first = [], 0, 1 + p
    gradient = [(fit.free.prior - fit.x) / fit.free.prior_sd**2]
    for target, (rows, prior) in zip(optimiser.segments, states, strict=True):
        series = np.concatenate([optimiser.sensitivities(target, fit.x).converged(), rows])
        gram = block_gram(series, optimiser.block_samples(target)).sum(axis=1)
        index = np.r_[0 : 1 + p, first : first + len(rows)]
        full = np.zeros((len(gram), 1 + p + q, 1 + p + q))
        full[np.ix_(range(len(gram)), index, index)] = gram
        grams.append(full)
        gradient.append(prior)
        first, samples = first + len(rows), samples + target.measured.size
    blocks = np.concatenate(grams)
    variance = residual_variance(float(blocks[:, 0, 0].sum()), samples, fit.normal.independent_share)
    precision = np.concatenate([1.0 / fit.free.prior_sd**2, np.ones(q)])
    return _Joint(blocks, precision, variance, np.concatenate(gradient))


def _initial_state_sensitivities(context: Context, fit: Fit, target: FitSegment) -> tuple[FloatArray, FloatArray]:
    """Sensitivities [q, channel, n] of a segment to its initial state in usual sizes, and the prior's gradient [q].

    Empty for windows and rigs, whose initial states are eliminated.
    """
    if target.has_free_start:
        return np.zeros((0, *target.measured.shape)), np.zeros(0)
    scale = state_scale(context.settings.initial_state, target.segment, fit.model)
    try:
        _, rows = sensitivities_to_start(fit.model, target, scale)
    except DivergedError:
        return np.zeros((0, *target.measured.shape)), np.zeros(0)
    table = target.segment.table(fit.model.wheelset_spacing(), target.steps)
    usual = state_on_rails(fit.model, table[0], len(target.initial_state))
    return rows, (usual - target.initial_state)[: len(scale)] / scale
