"""Cross-validated errors of a refit against ridge regressions without each fold."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from railui.campaign.settings.detection import RefitSettings
from railui.identification.estimation.fit import Fit, NormalEquations
from railui.identification.structure.refit import cross_validation_errors

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
    fit = cast(Fit, SimpleNamespace(normal=normal, free=free, x=estimate))
    errors = cross_validation_errors(RefitSettings(), fit)[:, 0]
    precision = normal.variance / PRIOR_SD**2
    for fold in np.array_split(np.arange(BLOCKS), RefitSettings().cross_validation_folds):
        others = np.setdiff1d(np.arange(BLOCKS), fold)
        a, b = x[others].reshape(-1, 3), y[others].ravel()
        without = np.linalg.solve(a.T @ a + np.diag(precision), a.T @ b + precision * PRIOR)
        assert errors[fold] == pytest.approx(np.sum((y[fold] - x[fold] @ without) ** 2, axis=1), rel=1e-9)
