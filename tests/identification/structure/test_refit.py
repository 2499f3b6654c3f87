"""Order of the refits, and cross-validated errors of one against ridge regressions without each fold."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from railui.campaign.settings.detection import RefitSettings, SelectionSettings
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit, NormalEquations
from railui.identification.structure.candidate_scores import NO_SCORE_TEST
from railui.identification.structure.pairs import refit_pairs
from railui.identification.structure.refit import (
    Refit,
    cross_validation_errors,
    cross_validation_nrmse,
    refit_candidates,
    refit_leading_first,
)
from railui.progress import Progress
from tests.blind.simulated import calibrated, simulated_campaign

BLOCKS, SAMPLES = 10, 30
PRIOR, PRIOR_SD = np.array([1.0, -0.5, 0.0]), np.array([0.3, 0.05, np.inf])


def test_a_left_out_block_is_predicted_by_the_other_blocks_and_the_priors() -> None:
    """The priors keep their means: an estimate without a fold is a ridge regression towards them."""
    rng = np.random.default_rng(3)
    x = rng.standard_normal((BLOCKS, SAMPLES, 3))
    y = x @ np.array([1.4, 0.3, -2.0]) + 0.5 * rng.standard_normal((BLOCKS, SAMPLES))
    estimate = np.array([1.2, -0.1, -1.9])  # of the fit, to whose residual the products belong
    rows = np.concatenate([(y - x @ estimate)[..., None], x], axis=2)
    gram = (rows.transpose(0, 2, 1) @ rows)[:, None]
    normal = NormalEquations(gram, BLOCKS * SAMPLES, 0.4)
    free = SimpleNamespace(prior=PRIOR, prior_sd=PRIOR_SD)
    fit = cast(Fit, SimpleNamespace(normal=normal, free=free, least_squares=estimate))
    errors = cross_validation_errors(RefitSettings(), fit)[:, 0]
    precision = normal.variance / PRIOR_SD**2
    for fold in np.array_split(np.arange(BLOCKS), RefitSettings().cross_validation_folds):
        others = np.setdiff1d(np.arange(BLOCKS), fold)
        a, b = x[others].reshape(-1, 3), y[others].ravel()
        without = np.linalg.solve(a.T @ a + np.diag(precision), a.T @ b + precision * PRIOR)
        assert errors[fold] == pytest.approx(np.sum((y[fold] - x[fold] @ without) ** 2, axis=1), rel=1e-9)


def test_the_cross_validated_error_of_runs_with_different_channels_is_that_of_each_channel() -> None:
    """Two runs with a lateral displacement of 3, one of them with an angle that counts nowhere and an acceleration."""

    def segment(*channels: str) -> SimpleNamespace:
        return SimpleNamespace(segment=SimpleNamespace(channels=channels), measured=np.full((len(channels), 4), 3.0))

    segments = (segment("y1", "psi1", "ay1"), segment("y1"))
    errors = np.array([[8.0, 99.0, 9.0], [10.0, 0.0, 0.0]])  # [block, channel]
    refit = cast(Refit, SimpleNamespace(fit=SimpleNamespace(segments=segments), block_errors=errors))
    assert cross_validation_nrmse(refit) == pytest.approx(np.sqrt((18.0 / 72.0 + 9.0 / 36.0) / 2))


def test_no_candidate_is_fitted_to_a_vehicle_that_diverges() -> None:
    class Lines(Progress):
        def message(self, text: str) -> None:
            lines.append(text)

    lines: list[str] = []
    fit, context = calibrated(), replace(simulated_campaign().context, progress=Lines())
    light = fit.model.with_path_values(["vehicle.frame.mass"], np.array([0.1]))  # kg: stiff beyond the steps of the fit
    assert refit_candidates(context, replace(fit, model=light), NO_SCORE_TEST) == []
    assert lines[-1].startswith("no candidate is fitted: the vehicle diverges")
    assert refit_pairs(context, replace(fit, model=light), []) == []
    assert lines[-1].startswith("no pair is fitted: the vehicle diverges")


def fit_of_misfit(rss: float) -> Fit:
    """Create a fit of which nothing but the misfit is known."""
    return cast(Fit, SimpleNamespace(normal=SimpleNamespace(rss=rss)))


@pytest.mark.parametrize(("least", "limit"), [(0.90, 1.05 * 0.90), (0.97, None)])
def test_other_candidates_are_only_evaluated_where_the_leading_ones_take_too_little(
    least: float, limit: float | None
) -> None:
    """An effect on trial has to take 5 % of the misfit of 1."""
    settings = SimpleNamespace(refit=RefitSettings(), selection=SelectionSettings())
    context = cast(Context, SimpleNamespace(settings=settings, campaign=SimpleNamespace(min_gain=0.19), jobs=1))
    limits: dict[str, float | None] = {}

    def refit(misfit_limit: float | None, item: tuple[str, Fit]) -> SimpleNamespace:
        limits[item[0]] = misfit_limit
        return SimpleNamespace(rss=item[1].normal.rss)

    screened = [(name, fit_of_misfit(least + x)) for name, x in (("c", 0.01), ("a", 0.0), ("b", 0.005), ("far", 0.5))]
    done = list(refit_leading_first(context, fit_of_misfit(1.0), screened, 1.25 * least, refit))
    assert len(done) == 4
    assert limits == {"a": np.inf, "b": np.inf, "far": np.inf, "c": limit if limit is None else pytest.approx(limit)}
