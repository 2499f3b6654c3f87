"""Covariance of estimates from the scores of blocks of time, without the bias of few or unequal blocks."""

from __future__ import annotations

import numpy as np
from scipy import linalg, special

from railui.arrays import FloatArray
from railui.identification.estimation.block_merging import independent_edges

MAX_LEVERAGE = 0.99  # of a block, in any direction of the parameters
MIN_ESTIMATE_FREEDOM = 4.0  # degrees of freedom of Student's t: that of a handful of blocks
TAIL = 0.95  # one end of a 90 % interval


def block_covariance(blocks: FloatArray, precision: FloatArray, variance: float) -> FloatArray:
    """Covariance [p, p] of estimates from the products of blocks, robust to correlation within a block.

    Parameters
    ----------
    blocks
        Products [block, 1 + p, 1 + p] of the residual and its sensitivities.
    precision
        Precisions [p] of the priors.
    variance
        Misfit per independent sample, which weighs the priors.

    Notes
    -----
    The sandwich A^-1 (sum of s_b s_b') A^-1 with the scores s_b of the residuals is too small, since the estimate
    follows the noise of every block. With the products G_b of a block, A^-1 (I - G_b A^-1)^-1 s_b is the change of the
    estimate where the block is left out: the sum of their squares, times 1 - 1/B with B blocks, is the variance of the
    jackknife (CR3: Bell and McCaffrey, Survey Methodology 28 (2002) 169). With few blocks of unequal weight it is not
    as much too small as CR2 (MacKinnon, Nielsen and Webb, J. Applied Econometrics 38 (2023) 671). The standard
    deviations are multiplied by the 95 % quantile of Student's t over that of the normal distribution, so that
    +/- 1.645 of them make a 90 % interval with few blocks, too. Blocks with correlated neighbours are merged first.
    """
    blocks = merge_correlated_blocks(blocks, precision, variance)
    scale, grams, a, inverse = _scaled_to_unit_diagonal(blocks, precision, variance)
    scores = _left_out_scores(grams, blocks[:, 1:, 0] * scale, a)
    estimates = np.sqrt(1.0 - 1.0 / max(len(blocks), 2)) * scores @ inverse * t_factors(grams, inverse)
    priors = inverse * scale * np.sqrt(precision) * variance
    return np.asarray((estimates.T @ estimates + priors @ priors.T) * np.outer(scale, scale))


def merge_correlated_blocks(blocks: FloatArray, precision: FloatArray, variance: float) -> FloatArray:
    """Merge neighbours where their parts in the estimates are correlated; parameters as for `block_covariance`."""
    scale, _, _, inverse = _scaled_to_unit_diagonal(blocks, precision, variance)
    edges = independent_edges((blocks[:, 1:, 0] * scale) @ inverse)
    return blocks if len(edges) == len(blocks) else np.add.reduceat(blocks, edges, axis=0)


def block_degrees_of_freedom(blocks: FloatArray, precision: FloatArray, variance: float) -> FloatArray:
    """Degrees of freedom [p] of the standard deviations that `block_covariance` returns for the same products."""
    blocks = merge_correlated_blocks(blocks, precision, variance)
    _, grams, _, inverse = _scaled_to_unit_diagonal(blocks, precision, variance)
    return degrees_of_freedom(grams, inverse)


def _scaled_to_unit_diagonal(
    blocks: FloatArray, precision: FloatArray, variance: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the scales [p] and what they scale: the products, the normal matrix, of unit diagonal, and its inverse."""
    a = blocks.sum(axis=0)[1:, 1:] + np.diag(precision) * variance
    scale = 1.0 / np.sqrt(np.maximum(np.diag(a), 1e-300))
    unit = np.outer(scale, scale)
    return scale, blocks[:, 1:, 1:] * unit, a * unit, np.asarray(linalg.pinvh(a * unit), dtype=np.float64)


def _left_out_scores(grams: FloatArray, scores: FloatArray, a: FloatArray) -> FloatArray:
    """Scores [block, p] of the residuals of a block with an estimate from all others."""
    values, vectors = np.linalg.eigh(a)
    roots = np.sqrt(np.maximum(values, 1e-12 * values[-1]))
    root, inverse_root = (vectors * roots) @ vectors.T, (vectors / roots) @ vectors.T
    leverage, axes = np.linalg.eigh(inverse_root @ grams @ inverse_root)
    factor = 1.0 / (1.0 - np.clip(leverage, 0.0, MAX_LEVERAGE))
    local = np.einsum("bij,bi->bj", axes, scores @ inverse_root) * factor
    return np.asarray(np.einsum("bij,bj->bi", axes, local) @ root)


def t_factors(grams: FloatArray, inverse: FloatArray) -> FloatArray:
    """Quantile [p] of Student's t over that of the normal distribution, from the share of each block in an estimate."""
    return interval_factor(degrees_of_freedom(grams, inverse))


def interval_factor(freedom: FloatArray) -> FloatArray:
    """Factor [p] by which a standard deviation is larger, so that +/- 1.645 of it makes a 90 % interval."""
    return np.asarray(special.stdtrit(freedom, TAIL) / special.ndtri(TAIL))


def degrees_of_freedom(grams: FloatArray, inverse: FloatArray) -> FloatArray:
    """Degrees of freedom [p] of a standard deviation from blocks, from the share of each block in an estimate.

    Source: Satterthwaite, Biometrics Bulletin 2 (1946) 110, with variances as the squared sensitivity of the blocks.
    """
    share = np.maximum(np.einsum("bij,ij->bj", grams @ inverse, inverse), 0.0)
    return effective_freedom(share / np.maximum(share.sum(axis=0), 1e-300), MIN_ESTIMATE_FREEDOM)


def effective_freedom(share: FloatArray, least: float) -> FloatArray:
    """Effective number of blocks less one, from their shares [block, ...] in an estimate; no less than `least`.

    Source: as `degrees_of_freedom`, whose formula it is with the shares of the blocks in the variance.

    >>> effective_freedom(np.full(8, 1 / 8), 1.0)  # equal blocks
    array(7.)
    """
    return np.asarray(np.maximum(1.0 / np.maximum(np.sum(share**2, axis=0), 1e-300) - 1.0, least))
