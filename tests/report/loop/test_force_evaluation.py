"""What a page shows of a run: the piece that tells most, whether a motion rules a force, the gauge under a wheelset."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from railui.report.loop import driven, figures

SAMPLES, DT = 4000, 0.01


def found(monkeypatch: pytest.MonkeyPatch, **series: np.ndarray) -> Any:
    """A loop with one validating stretch of 40 s, its series as compared."""
    monkeypatch.setattr(figures, "compared_series", lambda one, index: {k: x[None] for k, x in series.items()})
    return SimpleNamespace(measurement=SimpleNamespace(validate=[SimpleNamespace(kind="bogie", dt=DT)]))


def between(begin: int, end: int) -> np.ndarray:
    n = np.arange(SAMPLES)
    return np.where((n >= begin) & (n < end), np.sin(n), 0.0)


def test_the_piece_is_shown_in_which_the_vehicle_as_found_does_better_by_most(monkeypatch: pytest.MonkeyPatch) -> None:
    x = np.sin(np.arange(SAMPLES))
    one = found(monkeypatch, measured=x, before=x + between(2000, 2500), after=x + 2.0 * between(3000, 3500))
    window = figures.most_informative_window(one)
    assert (window.begin, window.end) == (pytest.approx(2000, abs=3), pytest.approx(2500, abs=3))


def test_where_nothing_was_added_the_piece_is_shown_in_which_it_moves_most(monkeypatch: pytest.MonkeyPatch) -> None:
    window = figures.most_informative_window(found(monkeypatch, measured=0.1 * between(0, SAMPLES) + between(1000, 1500)))
    assert (window.begin, window.end) == (pytest.approx(1000, abs=3), pytest.approx(1500, abs=3))


def test_a_motion_rules_a_force_as_far_as_it_is_its_function() -> None:
    rng = np.random.default_rng(1)
    x, other = rng.standard_normal((2, 20_000))
    assert driven.explained_variance(x, np.tanh(x)) > 0.99
    assert driven.explained_variance(x, other) < 0.02
    assert driven.explained_variance(x, x + other) == pytest.approx(0.5, abs=0.02)
    assert driven.explained_variance(x, np.ones_like(x)) == 1.0


def test_the_trailing_wheelset_meets_the_gauge_one_wheelbase_later() -> None:
    s = np.linspace(0.0, 100.0, 1001)
    scene: Any = SimpleNamespace(
        stretch=SimpleNamespace(columns={"s": s, "gauge": 1e-3 * s}), model=SimpleNamespace(behind=lambda: (0.0, 2.5))
    )
    first, second = (driven.gauge_at_wheelset(scene, i) for i in (1, 2))
    assert first is not None and second is not None
    assert first[500] == pytest.approx(0.05) and second[500] == pytest.approx(0.0475)
    scene.stretch.columns["gauge"] = 0.0 * s
    assert driven.gauge_at_wheelset(scene, 1) is None
