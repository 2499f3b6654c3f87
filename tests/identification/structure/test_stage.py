"""Gain of one stage of a selection over another: minimum gain, significance, noise of the sensors; look-alikes."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.signal import lfilter

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.noise_floor import estimate_noise_floor, sensor_noise_error
from railui.identification.estimation.validation import Validation
from railui.identification.structure import stage as module
from railui.identification.structure.candidate_scores import NO_SCORE_TEST
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.pairs import PairRefit
from railui.identification.structure.refit import Refit
from railui.identification.structure.stage import (
    SelectionStep,
    Stage,
    gains,
    indistinguishable_kinds,
    is_decisive,
    pair_steps,
)
from railui.identification.structure.student import from_normal
from tests.blind.simulated import simulated_campaign

BLOCKS = 20


def made(rss: float, nrmse: float, scatter: float = 0.0) -> Stage:
    """A stage with a misfit of a hundred samples and blocks of squared error that alternate by a share."""
    signs = np.where(np.arange(BLOCKS) % 2, 1.0, -1.0)
    blocks = nrmse**2 / BLOCKS * (1.0 + scatter * signs)
    fit = SimpleNamespace(normal=SimpleNamespace(misfit_per_sample=rss / 100))
    return Stage(cast(Fit, fit), Validation({}, nrmse, (), (), blocks))


@pytest.fixture
def context(monkeypatch: pytest.MonkeyPatch) -> Context:
    """A context in which the sensors' noise leaves an NRMSE of 0.14, with a minimum relative gain of 10 %."""
    monkeypatch.setattr(module, "sensor_noise_error", lambda *_: 0.14)
    return simulated_campaign().context


def test_ten_per_cent_less_error_is_a_gain(context: Context) -> None:
    # 1 - 0.9^2 = 0.19 of the squared error
    assert gains(context, made(100.0, 1.0), made(99.0, 0.899))
    assert not gains(context, made(100.0, 1.0), made(99.0, 0.901))


def test_sensor_noise_does_not_count_where_the_misfit_is_halved(context: Context) -> None:
    # of 0.17^2 = 0.0289 some 0.0196 are noise: 0.19 of the other 0.0093 are 0.0018, so 0.1647 is the limit
    old = made(100.0, 0.17)
    assert gains(context, old, made(49.0, 0.1645))
    assert not gains(context, old, made(49.0, 0.1650))
    assert not gains(context, old, made(51.0, 0.1645))


def test_such_a_gain_has_to_exceed_three_standard_errors(context: Context) -> None:
    old, new = made(100.0, 0.17), made(20.0, 0.16)
    gain = old.validation.error_reduction(new.validation).share
    # blocks that alternate by c of the new error: standard error c (0.16/0.17)^2 / sqrt(20 - 1)
    limit = gain / from_normal(3.0, BLOCKS - 1) * np.sqrt(BLOCKS - 1) * (0.17 / 0.16) ** 2
    assert gains(context, old, made(20.0, 0.16, scatter=0.98 * limit))
    assert not gains(context, old, made(20.0, 0.16, scatter=1.02 * limit))


@pytest.mark.parametrize(("memory", "limit"), [(0.0, 0.004), (0.5, 0.007), (0.9, 0.02)])
def test_chance_is_seldom_a_decisive_gain(context: Context, memory: float, limit: float) -> None:
    """Probability beyond three standard errors: 0.00135; with all 100 blocks counted, 0.05 at a memory of 0.9."""
    rng, draws = np.random.default_rng(8), 1500
    less = lfilter([1.0], [1.0, -memory], rng.standard_normal((draws, 160)), axis=1)[:, 60:]
    ones = np.ones(100)
    before = Validation({}, 10.0, (), (), ones)
    decisive = [
        is_decisive(context.settings.selection, before.error_reduction(Validation({}, 10.0, (), (), ones - 1e-3 * row)))
        for row in less
    ]
    assert np.mean(decisive) <= limit


def test_one_block_has_no_decisive_gain(context: Context) -> None:
    old, new = (Validation({}, x, (), (), np.array([x**2])) for x in (1.0, 0.1))
    assert not is_decisive(context.settings.selection, old.error_reduction(new))


def test_the_error_of_sensor_noise_is_that_of_its_realisations() -> None:
    simulated = simulated_campaign()
    context: Context = replace(simulated.context, nominal=simulated.true_model)
    segments: Any = context.dataset.selection
    drawn = estimate_noise_floor(context, context.nominal, segments).sensors_only
    assert sensor_noise_error(context, segments) == pytest.approx(drawn, rel=0.05)


def refit(kind: str, error: float, at: str = "primary_lateral") -> Refit:
    """A refit of a kind of which nothing is known but its squared cross-validated error."""
    return Refit(Candidate(kind, at, None), cast(Fit, SimpleNamespace()), np.full((4, 2), error / 8.0))


ALONE = (refit("free_play", 1.0), refit("bump_stop", 1.1), refit("spring", 1.3), refit("dry_friction", 0.5, "contact"))


def test_kinds_are_compared_with_the_added_effect_and_not_with_the_best_at_another_location() -> None:
    # an error of 1.10 times that of the clearance is 1.21 times its square
    step = SelectionStep(NO_SCORE_TEST, ALONE, refit("free_play", 0.9))
    assert indistinguishable_kinds(simulated_campaign().context, step) == ["free_play", "bump_stop"]


def test_kinds_fitted_with_all_other_effects_are_compared_with_each_other_alone() -> None:
    fitted = (refit("spring", 0.010), refit("cubic_stiffness", 0.011), refit("bump_stop", 0.013))
    step = SelectionStep(NO_SCORE_TEST, ALONE, refit("spring", 0.0099), alternatives=fitted)
    assert indistinguishable_kinds(simulated_campaign().context, step) == ["spring", "cubic_stiffness"]


def test_the_steps_of_a_pair_compare_single_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fit of two effects is no refit of a candidate alone, and has none to be compared with."""
    monkeypatch.setattr(module, "cross_validation_errors", lambda settings, fit: np.full((4, 2), 1e-3))
    halves = [SimpleNamespace(candidate=Candidate(kind, "primary_lateral", None)) for kind in ("free_play", "spring")]
    score: Any = SimpleNamespace(first=halves[0], second=halves[1])
    fit = cast(Fit, SimpleNamespace())
    context = simulated_campaign().context
    steps = pair_steps(context, SelectionStep(NO_SCORE_TEST, ALONE, None), PairRefit(score, fit))
    assert [s.refits for s in steps] == [ALONE, ALONE]
    assert [s.added.fit for s in steps if s.added] == [fit, fit]
    assert [indistinguishable_kinds(context, s) for s in steps] == [["free_play"], ["spring"]]
