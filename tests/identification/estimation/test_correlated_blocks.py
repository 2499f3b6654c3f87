"""Covariance of estimates whose residuals are correlated over more than a block."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from railui.arrays import FloatArray
from railui.identification.estimation.block_merging import LEAST_MERGED
from railui.identification.estimation.block_products import block_gram
from railui.identification.estimation.block_ratio import ratio_standard_error
from railui.identification.estimation.covariance import block_covariance, merge_correlated_blocks

NO_PRIOR = np.zeros(2)


def grams(
    rng: np.random.Generator, memory: float, samples: int = 4000, length: int = 40
) -> tuple[FloatArray, FloatArray]:
    """Return the products of residual and sensitivities in blocks, and the estimates [2] of a truth of 0.

    memory: of the first-order processes of noise and sensitivities, per sample.
    """
    noise, *x = lfilter([1.0], [1.0, -memory], rng.standard_normal((3, samples + 500)), axis=1)[:, 500:]
    rows = np.stack(x)
    estimate = np.linalg.solve(rows @ rows.T, rows @ noise)
    series = np.vstack([noise - estimate @ rows, rows])[:, None, :]
    return block_gram(series, length).sum(axis=1), estimate


@pytest.mark.parametrize("memory", [0.0, 0.98])
def test_intervals_contain_the_truth_nine_times_in_ten(memory: float) -> None:
    rng, inside = np.random.default_rng(4), []
    for _ in range(150):
        blocks, estimate = grams(rng, memory)
        sd = np.sqrt(np.diag(block_covariance(blocks, NO_PRIOR, 1.0)))
        inside.append(np.abs(estimate) < 1.645 * sd)
    assert np.mean(inside) == pytest.approx(0.9, abs=0.06)


def test_blocks_of_white_noise_are_not_merged() -> None:
    rng = np.random.default_rng(5)
    merged = sum(len(merge_correlated_blocks(grams(rng, 0.0)[0], NO_PRIOR, 1.0)) < 100 for _ in range(100))
    assert merged <= 5


def test_merged_blocks_have_the_same_sum() -> None:
    blocks, _ = grams(np.random.default_rng(6), 0.995)
    merged = merge_correlated_blocks(blocks, NO_PRIOR, 1.0)
    assert LEAST_MERGED <= len(merged) < len(blocks)
    np.testing.assert_allclose(merged.sum(axis=0), blocks.sum(axis=0), rtol=1e-12, atol=1e-6)


@pytest.mark.parametrize("memory", [0.0, 0.5])
def test_the_standard_error_of_a_ratio_holds_for_correlated_blocks(memory: float) -> None:
    rng, z = np.random.default_rng(7), []
    for _ in range(300):
        less = lfilter([1.0], [1.0, -memory], rng.standard_normal(160))[60:]
        scale = 20.0 + rng.standard_normal(100)
        z.append(less.sum() / scale.sum() / ratio_standard_error(less, scale))
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1.0, abs=0.25)
