"""The excerpt of the runs that the report shows."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from railui.report.loop import figures

SAMPLES, DT = 4000, 0.01
CUT = 200  # samples left out at either end


def result(monkeypatch: pytest.MonkeyPatch, **series: np.ndarray) -> Any:
    """Return a loop result with one validation segment of 40 s and these compared series."""
    monkeypatch.setattr(figures, "compared_series", lambda _, index: {k: x[None] for k, x in series.items()})
    segment = SimpleNamespace(is_rig=False, is_free=False, window_of=None, dt=DT, samples=SAMPLES + 2 * CUT)
    campaign = SimpleNamespace(cut_length=lambda _: CUT * DT)
    settings = SimpleNamespace(initial_state=SimpleNamespace(initial_state_duration=4.0))
    dataset = SimpleNamespace(validation=[segment], campaign=campaign)
    return SimpleNamespace(dataset=dataset, context=SimpleNamespace(settings=settings))


def burst(begin: int, end: int) -> np.ndarray:
    n = np.arange(SAMPLES)
    return np.where((n >= begin) & (n < end), np.sin(n), 0.0)


def test_the_excerpt_has_the_largest_reduction_of_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    x = np.sin(np.arange(SAMPLES))
    series = {"measured": x, "before": x + burst(2000, 2500), "after": x + 2.0 * burst(3000, 3500)}
    window = figures.most_informative_window(result(monkeypatch, **series))
    assert (window.begin, window.end) == (pytest.approx(2000, abs=3), pytest.approx(2500, abs=3))


def test_without_an_effect_the_excerpt_has_the_largest_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    measured = 0.1 * burst(0, SAMPLES) + burst(1000, 1500)
    window = figures.most_informative_window(result(monkeypatch, measured=measured))
    assert (window.begin, window.end) == (pytest.approx(1000, abs=3), pytest.approx(1500, abs=3))


def test_the_excerpt_leaves_out_what_estimated_the_initial_state(monkeypatch: pytest.MonkeyPatch) -> None:
    window = figures.most_informative_window(result(monkeypatch, measured=burst(0, 250)))
    assert (window.begin, window.end) == (200, 700)


def test_many_long_names_of_channels_are_slanted() -> None:
    def drawn(names: list[str]) -> str:
        errors = {"nrmse": 0.1, "channels": dict.fromkeys(names, 0.1)}
        return figures.error_bars({model: errors for model in ("declared", "before", "after", "floor")}).svg.decode()

    assert "rotate(-30" not in drawn(["e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2"])
    assert drawn([f"floor_{i}" for i in range(12)]).count("rotate(-30") == 13
