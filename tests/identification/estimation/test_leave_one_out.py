"""Leave-one-run-out errors: to first order where the response changes little, else none."""

from __future__ import annotations

import numpy as np
import pytest

from railui.identification.estimation.leave_one_out import left_out_error
from railui.report.loop.summary import left_out_lines

ROW = {"file": "a.csv", "role": "adjust", "nrmse_with_all": 0.8}


@pytest.mark.parametrize("size", [0.02, 0.2, 0.4, 200.0])
def test_an_error_is_computed_only_where_the_response_changes_little(size: float) -> None:
    rng = np.random.default_rng(2)
    measured, sensitivities = rng.standard_normal((2, 500)), rng.standard_normal((2, 3, 500))
    residual = 0.1 * rng.standard_normal((2, 500))
    step = rng.standard_normal(3)
    change = np.einsum("p,cpn->cn", step, sensitivities)
    step *= size / np.sqrt(np.mean(np.sum(change**2, axis=1) / np.sum(measured**2, axis=1)))
    series = np.concatenate([residual[:, None], sensitivities], axis=1)
    grams = np.einsum("cin,cjn->cij", series, series)
    error = left_out_error(grams, np.sum(measured**2, axis=1), step, 0.3)
    if size > 0.3:
        assert error is None
    else:
        left = residual - np.einsum("p,cpn->cn", step, sensitivities)
        expected = np.sqrt(np.mean(np.sum(left**2, axis=1) / np.sum(measured**2, axis=1)))
        assert error == pytest.approx(expected)


def test_the_summary_names_a_run_without_such_an_error() -> None:
    (line,) = left_out_lines({"leave_one_run_out": [{**ROW, "nrmse": 0.81}, {**ROW, "nrmse": None}]})
    assert "a.csv (estimation) 0.810, 0.800 with it" in line
    assert "a.csv (estimation) unknown without it (the parameters change too much for first order)" in line
