"""Forces by the kernel over a given motion, explained variance, gauge under a wheelset."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from railui.identification.component_force import restoring_force
from railui.report.loop.force_evaluation import explained_variance, gauge_at_wheelset
from railui.vehicle.effects import PlacedEffect


def test_the_restoring_force_of_a_clearance_has_a_dead_zone() -> None:
    k, h, t = 4e6, 0.3e-3, np.arange(2000) * 0.005
    z = 1e-3 * np.sin(7.0 * t) * np.cos(1.3 * t)
    expected = k * np.sign(z) * np.maximum(np.abs(z) - h, 0.0)
    effect = PlacedEffect("free_play", "primary_lateral", None, {"half_width": h})
    force, speed = restoring_force(z, 0.005, [effect], k, 0.0)
    assert np.abs(force - expected).max() < 1e-4 * np.abs(expected).max()
    assert np.abs(speed - np.gradient(z, 0.005))[1:-1].max() < 0.01 * np.abs(speed).max()


def test_the_restoring_force_of_spring_and_damper_is_their_sum() -> None:
    t = np.arange(1000) * 0.005
    z, v = 1e-3 * np.sin(9.0 * t), 9e-3 * np.cos(9.0 * t)
    force, _ = restoring_force(z, 0.005, [], 2e5, 3e4)
    assert np.abs(force - (2e5 * z + 3e4 * v)).max() < 1e-3 * np.abs(force).max()


def test_explained_variance_is_the_share_that_a_function_explains() -> None:
    rng = np.random.default_rng(1)
    x, other = rng.standard_normal((2, 20_000))
    assert explained_variance(x, np.tanh(x)) > 0.99
    assert explained_variance(x, other) < 0.02
    assert explained_variance(x, x + other) == pytest.approx(0.5, abs=0.02)
    assert explained_variance(x, np.ones_like(x)) == 1.0


def test_the_trailing_wheelset_reaches_the_gauge_one_wheelbase_later() -> None:
    s = np.linspace(0.0, 100.0, 1001)
    evaluation: Any = SimpleNamespace(
        segment=SimpleNamespace(columns={"s": s, "gauge": 1e-3 * s}),
        model=SimpleNamespace(wheelset_distances=lambda: (0.0, 2.5)),
    )
    leading, trailing = (gauge_at_wheelset(evaluation, wheelset) for wheelset in (1, 2))
    assert leading is not None and trailing is not None
    assert leading[500] == pytest.approx(0.05) and trailing[500] == pytest.approx(0.0475)
    evaluation.segment.columns["gauge"] = 0.0 * s
    assert gauge_at_wheelset(evaluation, 1) is None
