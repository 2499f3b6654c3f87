"""Covariance of estimates from few blocks, bias from track noise, and sensors taken away."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.comparison import kernel_filter
from railui.campaign.dataset import read_dataset
from railui.campaign.noise.model import NoiseModel
from railui.identification.context import Context, create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.covariance import block_covariance, t_factors
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.identifiability import profile_likelihood
from railui.identification.estimation.initial_state import state_on_rails
from railui.identification.estimation.problem import FitSegment
from railui.identification.estimation.unbiased import (
    _initial_state_sensitivities,
    track_noise_scores,
    with_unbiased_estimates,
)
from railui.identification.prediction import Simulation, required_steps
from tests.truth.campaign import Campaign, Order, campaign, write
from tests.truth.files import paths

DESIGNS = Path(__file__).parents[3] / "designs"
NORMAL_QUANTILE_95 = 1.6449
ACCELEROMETERS = ("ay1", "ay2", "ayf")
TRACK = ("t", "s", "v", "yw", "phiw", "gauge")
HELD_BY_PRIORS = ("contact_angle", "spin_creep", "gravitational_stiffness")


def few_blocks(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Error of a regression on 10 blocks of very different size, and its products [block, 1 + p, 1 + p]."""
    rng = np.random.default_rng(seed)
    size = np.repeat(rng.uniform(0.1, 1.5, (10, 1)) ** 2, 20, axis=0)
    x, noise = size * rng.standard_normal((200, 3)), rng.standard_normal(200)
    error = np.linalg.lstsq(x, noise, rcond=None)[0]
    rows = np.column_stack([noise - x @ error, x]).reshape(10, 20, 4)
    return error, rows.transpose(0, 2, 1) @ rows


def test_intervals_of_few_unequal_blocks_cover_ninety_per_cent():
    inside, inside_plain = [], []
    for seed in range(400):
        error, blocks = few_blocks(seed)
        inverse = np.linalg.inv(blocks.sum(axis=0)[1:, 1:])
        scores = blocks[:, 1:, 0] @ inverse
        sd = np.sqrt(np.diag(block_covariance(blocks, np.zeros(3), 1.0)))
        inside.append(np.abs(error) <= NORMAL_QUANTILE_95 * sd)
        inside_plain.append(np.abs(error) <= NORMAL_QUANTILE_95 * np.sqrt(np.sum(scores**2, axis=0)))
    assert 0.88 <= np.mean(inside) <= 0.93
    assert np.mean(inside_plain) < 0.86


def test_the_variance_is_that_of_estimates_without_one_block_after_the_other():
    """Without priors: (1 - 1/B) times the sum of squared changes, in the units of Student's t."""
    _, blocks = few_blocks(5)
    total, grams = blocks.sum(axis=0), blocks[:, 1:, 1:]
    changes = np.array([np.linalg.solve(total[1:, 1:] - b[1:, 1:], total[1:, 0] - b[1:, 0]) for b in blocks])
    expected = np.sqrt(0.9 * np.sum(changes**2, axis=0)) * t_factors(grams, np.linalg.inv(total[1:, 1:]))
    sd = np.sqrt(np.diag(block_covariance(blocks, np.zeros(3), 1.0)))
    assert sd == pytest.approx(expected, rel=1e-9)


def test_a_prior_alone_gives_its_own_standard_deviation():
    blocks = np.zeros((5, 3, 3))
    blocks[:, 0, 0] = 1.0
    covariance = block_covariance(blocks, 1.0 / np.array([0.5, 2.0]) ** 2, 1.0)
    assert np.sqrt(np.diag(covariance)) == pytest.approx([0.5, 2.0])


@cache
def noisy_track() -> Campaign:
    """A campaign whose track is recorded with four times the usual noise."""
    noise = {"yw": 8e-5, "phiw": 8e-5, "gauge": 2e-4}
    return campaign(Order(seed=7, seconds=(40.0, 20.0), noise=noise))


def fitted(truth: Campaign, folder: Path) -> tuple[Context, Fit]:
    write(truth, folder)
    context = create_context(read_dataset(load_campaign(folder)), jobs=1)
    return context, calibrate(context)


def scores_of_truth(truth: Campaign, fit: Fit) -> np.ndarray:
    """Error over standard deviation of the parameters that the data determine."""
    true = paths(truth.vehicle)
    used = [j for j, p in enumerate(fit.free.paths) if p.rpartition(".")[2] not in HELD_BY_PRIORS]
    return np.array([(fit.x[j] - true[fit.free.paths[j]]) / fit.sd[j] for j in used])


def test_last_step_removes_the_bias_from_track_noise(tmp_path):
    context, fit = fitted(noisy_track(), tmp_path)
    last = with_unbiased_estimates(context, fit)
    assert last.shift.any()
    before, after = scores_of_truth(noisy_track(), fit), scores_of_truth(noisy_track(), last)
    assert np.sqrt(np.mean(after**2)) < 0.75 * np.sqrt(np.mean(before**2))
    assert np.allclose(last.least_squares, fit.x)


def with_track_noise(context: Context, log_sd: float | None) -> Context:
    """The context with track noise of a level that is known so closely; None: without any."""
    columns = {c: n for c, n in context.noise.columns.items() if log_sd is not None or c not in TRACK}
    columns = {c: replace(n, log_sd=log_sd) if c in TRACK else n for c, n in columns.items()}
    return replace(context, dataset=replace(context.dataset, noise=NoiseModel(columns)))


def test_the_level_of_track_noise_is_uncertain_by_one_factor(tmp_path):
    """The bias grows as its square: a standard deviation of 0.3 of its logarithm is one of 0.6 of the bias."""
    context, fit = fitted(noisy_track(), tmp_path)
    without, exact, uncertain = (
        with_unbiased_estimates(with_track_noise(context, log_sd), fit) for log_sd in (None, 0.0, 0.3)
    )
    bias = without.shift - exact.shift
    assert bias.any() and np.allclose(uncertain.shift, exact.shift)
    added = uncertain.covariance - exact.covariance
    spread = np.sqrt(np.diag(exact.covariance))
    assert np.allclose(added / np.outer(spread, spread), 0.36 * np.outer(bias / spread, bias / spread), atol=1e-9)


def test_no_stated_track_noise_gives_no_bias(tmp_path):
    context, fit = fitted(noisy_track(), tmp_path)
    exact = {c: sd for c, sd in context.noise.items() if c not in TRACK}
    context = replace(context, dataset=replace(context.dataset, noise=exact))
    assert not track_noise_scores(context, fit, None).mean.any()


@pytest.mark.parametrize(("realisations", "is_subtracted"), [(1, False), (2, True)])
def test_a_bias_needs_two_realisations_on_which_the_vehicle_does_not_diverge(
    realisations, is_subtracted, tmp_path, monkeypatch
):
    context, fit = fitted(noisy_track(), tmp_path)
    optimiser, calls = GaussNewton.of_fit(context, fit), Counter()
    simulate = optimiser.sensitivities

    def sensitivities(target, x, table):
        calls[target.segment.number] += 1
        series, diverged = simulate(target, x, table)
        is_valid = calls[target.segment.number] <= 2 * realisations  # each with noise of both signs
        return Simulation(series, diverged if is_valid else np.zeros_like(diverged))

    monkeypatch.setattr(optimiser, "sensitivities", sensitivities)
    scores = track_noise_scores(context, fit, optimiser)
    assert scores.mean.any() == scores.deviations.any() == is_subtracted


def test_the_error_of_the_bias_falls_with_the_root_of_the_number_of_draws(tmp_path):
    context, fit = fitted(noisy_track(), tmp_path)
    errors = []
    for draws in (4, 16):
        calibration = replace(context.settings.calibration, bias_draws=draws)
        settled = replace(context, settings=replace(context.settings, calibration=calibration))
        optimiser = GaussNewton.of_fit(settled, fit)
        scores = track_noise_scores(settled, fit, optimiser)
        assert np.allclose(scores.deviations.sum(axis=0), 0.0, atol=1e-9 * np.abs(scores.deviations).max())
        errors.append(np.sqrt(np.sum(scores.deviations**2, axis=0)))
    assert 0.3 < np.median(errors[1] / errors[0]) < 0.8


def test_a_vehicle_on_its_rails_has_the_initial_state_that_is_expected() -> None:
    """The prior of its initial state does not pull it towards the axis from which the track is measured."""
    context = create_context(read_dataset(load_campaign(DESIGNS / "campaigns" / "worn_centre_guide")), jobs=1)
    model, segment = context.nominal, context.dataset.estimation[0].truncated(2000)
    steps = required_steps(model, segment)
    states = model.vehicles().state_count(model.single_batch())
    start = state_on_rails(model, segment.table(model.wheelset_spacing(), steps)[0], states)
    every = np.ones(len(segment.channels))
    kernel = kernel_filter(context.campaign, segment, every)
    target = FitSegment(segment, kernel, np.zeros((0, 0)), start, steps, steps)
    fit = cast(Fit, SimpleNamespace(model=model))
    rows, gradient = _initial_state_sensitivities(context, fit, target)
    assert start.any() and len(rows) == len(gradient)
    assert not gradient.any()


def test_profile_is_centred_on_the_unbiased_estimate(tmp_path):
    context, fit = fitted(noisy_track(), tmp_path)
    last, path = with_unbiased_estimates(context, fit), "vehicle.secondary.lateral_damping"
    profile = profile_likelihood(context, last, path)
    j = last.free.paths.index(path)
    assert abs(profile.values[np.argmin(profile.deviance)] - last.x[j]) < 1e-9 * last.x[j]


def test_standard_deviations_do_not_shrink_with_fewer_channels(tmp_path):
    truth = noisy_track()
    few = {k: {c: x for c, x in run.items() if c in (*TRACK, *ACCELEROMETERS)} for k, run in truth.runs.items()}
    context, fit = fitted(truth, tmp_path / "all")
    with_all = with_unbiased_estimates(context, fit)
    context, fit = fitted(replace(truth, runs=few), tmp_path / "few")
    with_few = with_unbiased_estimates(context, fit)
    ratio = with_few.sd / with_all.sd
    assert ratio.min() > 0.8  # the standard deviations themselves scatter by a tenth
    assert np.median(ratio) > 1.2
