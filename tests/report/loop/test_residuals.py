"""Residuals of the loop page: white for a correct model, coloured for a wrong one; force law and its evidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from railui.identification.estimation.noise_floor import SimulatedTruth
from railui.identification.result import LoopResult
from railui.report.loop.figures import most_informative_window
from railui.report.loop.force_evaluation import EvaluationWindow, most_active_port, total_force
from railui.report.loop.law_evidence import effect_force, law_evidence
from railui.report.loop.residual_figures import _autocorrelation
from railui.report.loop.residuals import ChannelResidual, channel_residuals
from tests.report.loop.names import CHANNELS


@pytest.fixture(scope="module")
def residuals(loop_result: LoopResult) -> dict[str, ChannelResidual]:
    return channel_residuals(loop_result, 0)


def test_every_channel_has_residuals_without_and_with_the_effect(residuals: dict[str, ChannelResidual]) -> None:
    assert list(residuals) == list(CHANNELS)
    assert all(list(r.series) == ["before", "after"] for r in residuals.values())
    assert all(r.ratio_to_noise("after") < 0.5 * r.ratio_to_noise("before") for r in residuals.values())


def test_the_residual_of_a_correct_model_is_white_noise_of_its_size(
    loop_result: LoopResult, residuals: dict[str, ChannelResidual]
) -> None:
    truth = SimulatedTruth(loop_result.context, loop_result.after.model, loop_result.dataset.validation[0], 0)
    noisy, simulated = truth.draw(99)
    drawn = [replace(r, series={"after": noisy[i] - simulated[i]}) for i, r in enumerate(residuals.values())]
    assert np.mean([r.whiteness("after").share_outside for r in drawn]) < 0.12
    assert all(0.6 < r.ratio_to_noise("after") < 1.6 for r in drawn)


def test_the_residual_without_the_effect_is_not_white(residuals: dict[str, ChannelResidual]) -> None:
    assert np.mean([r.whiteness("before").share_outside for r in residuals.values()]) > 0.25


def test_lags_follow_the_samples_of_slow_sampling() -> None:
    dt, noise = 4.0, np.random.default_rng(3).standard_normal((9, 600))
    series = {"before": noise[0] + np.sin(np.arange(600) / 20.0), "after": noise[1]}
    residual = ChannelResidual("z", dt, series, noise[2:], (0.0, 0.125), np.zeros(0), {})
    before, after = residual.whiteness("before"), residual.whiteness("after")
    assert after.lags[-1] == dt * (len(after.correlation) - 1) >= 20 * dt
    assert before.share_outside > 0.5 > 0.25 > after.share_outside
    _, _, draw = _autocorrelation(residual)
    axes = Figure().subplots()
    draw(axes)
    assert axes.get_xlim() == (0.0, after.lags[-1])


def test_free_force_points_follow_the_law_of_the_clearance(loop_result: LoopResult) -> None:
    evaluation = EvaluationWindow.of(loop_result, loop_result.after.model, most_informative_window(loop_result))
    (effect,) = evaluation.model.design.effects
    w, z = most_active_port(evaluation, effect.at, effect.wheelset)
    curves, v = total_force(evaluation, effect.at, w, z)
    own = effect_force(evaluation.model, 0, w, z, v, evaluation.segment.dt)
    found = law_evidence(evaluation, 0, w, z, v, "z", curves["after"] - own)
    order = np.argsort(z)
    law = np.interp(found.motion, z[order], curves["after"][order])
    assert len(found.motion) > 12 and found.half_width is not None
    inner = np.abs(found.motion) < 0.8 * np.abs(found.motion).max()
    assert np.std((found.force - law)[inner]) < 0.1 * np.std(law[inner])
    assert 0.0 < np.median(found.half_width) < 0.1 * np.std(own)
