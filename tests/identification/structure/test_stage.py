"""Gain of one stage of a selection over another: minimum gain, significance, and noise of the sensors."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.noise_floor import estimate_noise_floor, sensor_noise_error
from railui.identification.estimation.validation import Validation
from railui.identification.structure import stage as module
from railui.identification.structure.stage import Stage, gains
from tests.blind.simulated import simulated_campaign

BLOCKS = 20


def made(rss: float, nrmse: float, scatter: float = 0.0) -> Stage:
    """A stage with a misfit of a hundred samples and blocks of squared error that alternate by a share."""
    signs = np.where(np.arange(BLOCKS) % 2, 1.0, -1.0)
    blocks = nrmse**2 / BLOCKS * (1.0 + scatter * signs)
    fit = SimpleNamespace(normal=SimpleNamespace(rss=rss, samples=100))
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
    gain, _ = old.validation.error_reduction(new.validation)
    # blocks that alternate by c of the new error: standard error c (0.16/0.17)^2 / sqrt(20 - 1)
    limit = gain / 3.0 * np.sqrt(BLOCKS - 1) * (0.17 / 0.16) ** 2
    assert gains(context, old, made(20.0, 0.16, scatter=0.98 * limit))
    assert not gains(context, old, made(20.0, 0.16, scatter=1.02 * limit))


def test_the_error_of_sensor_noise_is_that_of_its_realisations() -> None:
    simulated = simulated_campaign()
    context: Context = replace(simulated.context, nominal=simulated.true_model)
    segments: Any = context.dataset.selection
    drawn = estimate_noise_floor(context, context.nominal, segments).sensors_only
    assert sensor_noise_error(context, segments) == pytest.approx(drawn, rel=0.05)
