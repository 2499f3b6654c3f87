"""Attribution of changes to parameters and effects, and estimates without the pull of their prior."""

from __future__ import annotations

import numpy as np
import pytest

from railui.arrays import FloatArray
from railui.fleet.attribution import Attribution, attribute, signatures_of
from railui.fleet.free_estimates import free_estimates
from railui.fleet.quick_path import estimates_of_gram
from railui.fleet.summary import RunSummary

SAMPLES = 4000
NAMES = ("a", "b", "free_play at rig")
PRIOR_SD = 0.5


def _run(rng: np.random.Generator, truth: FloatArray, rows: FloatArray, prior_sd: float = PRIOR_SD) -> RunSummary:
    """Return a linear run at x = 0: two parameters, one effect, a residual of their truth and unit noise."""
    residual = truth @ rows + rng.standard_normal(rows.shape[1])
    stacked = np.vstack([residual, rows])
    gram, zeros = stacked @ stacked.T, np.zeros(2)
    found = estimates_of_gram(gram, zeros, zeros, np.full(2, prior_sd), 1.0)
    names = (NAMES[:2], NAMES[2:], ("z",))
    return RunSummary(*names, zeros, gram, *found, np.ones(1), 1.0, SAMPLES, np.nan, np.nan, 1.0)


def _correlated_rows(rng: np.random.Generator) -> FloatArray:
    """Sensitivities and a difference that resemble each other."""
    rows = rng.standard_normal((3, SAMPLES))
    rows[2] += 0.7 * rows[0] - 0.5 * rows[1]
    return rows


def _attributed(truth: FloatArray, seed: int) -> Attribution:
    rng = np.random.default_rng(seed)
    rows = _correlated_rows(rng)
    runs = [_run(rng, truth, rows) for _ in range(4)]
    change = np.mean([r.estimate for r in runs], axis=0)
    sound = [_run(rng, np.zeros(3), rows).estimate for _ in range(200)]
    covariance = np.cov(np.array(sound).T) / 4
    return attribute(change, covariance, signatures_of(runs, np.full(4, 0.25), NAMES, np.ones(3)))


@pytest.mark.parametrize(("at", "name"), list(enumerate(NAMES)))
def test_the_number_that_changed_is_the_best_explanation(at: int, name: str) -> None:
    truth = np.zeros(3)
    truth[at] = 0.2
    found = _attributed(truth, at)
    best = found.explanations[0]
    assert best.name == name
    assert best.change == pytest.approx(0.2, abs=4.0 * best.sd)
    assert found.explained > 0.9
    assert found.fit_probability > 1e-3


def test_a_change_of_several_numbers_is_not_explained_by_one() -> None:
    found = _attributed(np.array([0.2, 0.2, 0.2]), 7)
    assert found.explained < 0.9
    assert found.fit_probability < 1e-6


def test_an_effect_moves_the_estimates_of_the_parameters_as_its_signature_states() -> None:
    rng = np.random.default_rng(5)
    rows = _correlated_rows(rng)
    exact = np.vstack([0.3 * rows[2], rows])
    zeros = np.zeros(2)
    gram = exact @ exact.T
    estimate, sd, determined = estimates_of_gram(gram, zeros, zeros, np.full(2, PRIOR_SD), 1.0)
    names = (NAMES[:2], NAMES[2:], ("z",))
    run = RunSummary(*names, zeros, gram, estimate, sd, determined, np.ones(1), 1.0, SAMPLES, np.nan, np.nan, 1.0)
    signature = signatures_of([run], np.ones(1), NAMES, np.ones(3))[NAMES[2]]
    assert 0.3 * signature == pytest.approx(estimate, abs=1e-9)


def test_estimates_without_the_prior_are_those_of_least_squares() -> None:
    """A prior as narrow as the data pulls to half the value; its pull is undone, and the scatter is doubled."""
    rng = np.random.default_rng(2)
    rows = np.zeros((3, SAMPLES))
    rows[:, :3] = np.eye(3) * 10.0  # orthogonal, of length 10: standard deviation 0.1
    run = _run(rng, np.array([0.4, -0.2, 0.0]), rows, prior_sd=0.1)
    free, sd = free_estimates(run)
    least_squares = run.gram[0, 1:3] / 100.0
    assert run.estimate[:2] == pytest.approx(0.5 * least_squares)
    assert free == pytest.approx(least_squares)
    assert sd == pytest.approx([0.1, 0.1])
