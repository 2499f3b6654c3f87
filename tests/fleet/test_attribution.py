"""Attribution of changes to parameters and effects from inner products."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from railui.arrays import FloatArray
from railui.fleet.attribution import attribute, shifted_gram
from railui.fleet.summary import RunSummary

SAMPLES = 400


def _run(rng: np.random.Generator, truth: FloatArray, rows: FloatArray) -> RunSummary:
    """Return a linear run at x = 0: two parameters, one effect, a residual of their truth and unit noise."""
    residual = truth @ rows + rng.standard_normal(SAMPLES)
    stacked = np.vstack([residual, rows])
    zeros = np.zeros(3)
    names = (("a", "b"), ("free_play at rig",), ("z",))
    return RunSummary(
        *names, zeros[:2], stacked @ stacked.T, zeros, zeros, zeros, np.ones(1), 1.0, SAMPLES, np.nan, np.nan, 1.0
    )


@pytest.mark.parametrize(("at", "name"), [(0, "a"), (1, "b"), (2, "free_play at rig")])
def test_the_number_that_changed_is_the_best_explanation(at: int, name: str) -> None:
    rng = np.random.default_rng(at)
    rows = rng.standard_normal((3, SAMPLES))
    truth = np.zeros(3)
    truth[at] = 0.5
    runs = [_run(rng, truth, rows) for _ in range(4)]
    found = attribute(runs, np.zeros((4, 3)), np.array([1e-3, 1e-3, 0.0]), np.ones(3))
    best = found.explanations[0]
    assert best.name == name
    assert best.change == pytest.approx(0.5, abs=4.0 * best.sd)
    assert found.explained > 0.9


def test_a_change_of_several_numbers_is_not_explained_by_one() -> None:
    rng = np.random.default_rng(7)
    rows = rng.standard_normal((3, SAMPLES))
    runs = [_run(rng, np.array([0.4, -0.4, 0.4]), rows) for _ in range(4)]
    found = attribute(runs, np.zeros((4, 3)), np.array([1e-3, 1e-3, 0.0]), np.ones(3))
    assert found.explained < 0.5


def test_products_about_other_values_are_those_of_the_residual_there() -> None:
    rng = np.random.default_rng(1)
    rows = rng.standard_normal((3, SAMPLES))
    run = _run(rng, np.array([0.3, 0.1, -0.2]), rows)
    residual = np.array([0.3, 0.1, -0.2]) @ rows
    noise = run.gram[0, 0]
    run = replace(run, gram=np.vstack([residual, rows]) @ np.vstack([residual, rows]).T, variance=2.0)
    about = np.array([0.1, 0.2, 0.3])
    moved = np.vstack([residual - about @ rows, rows])
    assert noise > 0.0
    assert shifted_gram(run, about) == pytest.approx(moved @ moved.T / 2.0)
