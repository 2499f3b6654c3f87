"""Variance components: levels and colours of independent noises from the cross spectra of their combinations.

At every frequency the expected density of the relations is sum_c N_c(f) g_c g_c^H, with g_c the gains of channel c and
N_c(f) = sum_k theta_ck s_ck(f), theta >= 0. The likelihood is that of complex Wishart matrices (Whittle).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import ComplexArray, FloatArray

MAX_ITERATIONS = 400
MIN_LEVEL_CHANGE = 1e-4  # relative, of a squared level in an iteration, below which the iteration ends
MAX_SCORING_STEPS = 60
MIN_SCORING_STEP = 1e-6
MAX_STEP = 0.7  # of the logarithm of a variance
COLOURED_START = 0.02  # variance of each coloured part over the white one at the start
WIDE_LOG_VARIANCE_SD = 4.0  # prior of a level about which nothing is known


@dataclass(frozen=True, eq=False)
class Observation:
    """Density [F, n, n] of n combinations, gains [F, n] and shapes [part, F] of each noise, independent averages."""

    density: ComplexArray
    gains: Mapping[str, ComplexArray]
    shapes: Mapping[str, FloatArray]
    averages: float


@dataclass(frozen=True, eq=False)
class Components:
    """Variances [part] per noise, without a prior; logarithms of levels with it, and their standard deviations.

    log_factor: natural logarithm of the amplitude with the prior over that of `variances`; log_sd: of amplitudes;
    data_log_sd: the same without the prior.
    """

    variances: Mapping[str, FloatArray]
    log_factor: Mapping[str, float]
    log_sd: Mapping[str, float]
    data_log_sd: Mapping[str, float]


def estimate_components(
    observations: Sequence[Observation],
    start: Mapping[str, FloatArray],
    prior: Mapping[str, tuple[float, float]],
    level: Mapping[str, FloatArray],
) -> Components:
    """Estimate variance components.

    Parameters
    ----------
    observations
        Densities of the records.
    start
        Variances [part] at the start, positive.
    prior
        Natural logarithm of the level (amplitude) of each noise and its standard deviation.
    level
        Weights [part] by which the variances add up to the squared level.

    Notes
    -----
    Majorisation-minimisation with multiplicative steps (Zhou, Hu, Zhou, Lange 2019) gives levels and colours; then
    Fisher scoring of the logarithms of the levels, with fixed colours, adds the log-normal prior.
    """
    theta = {c: np.array(v, dtype=np.float64) for c, v in start.items()}
    for _ in range(MAX_ITERATIONS):
        before = np.array([level[c] @ theta[c] for c in theta])
        up, down = _sums(observations, theta)
        theta = {c: theta[c] * np.sqrt(up[c] / np.maximum(down[c], 1e-300)) for c in theta}
        after = np.array([level[c] @ theta[c] for c in theta])
        if np.max(np.abs(after - before) / np.maximum(before, 1e-300)) < MIN_LEVEL_CHANGE:
            break
    names = list(theta)
    centre = np.array([2.0 * prior[c][0] - np.log(max(float(level[c] @ theta[c]), 1e-300)) for c in names])
    precision = np.array([1.0 / (2.0 * prior[c][1]) ** 2 for c in names])
    x = np.zeros(len(names))
    for _ in range(MAX_SCORING_STEPS):
        score, information = _score(observations, {c: np.exp(v) * theta[c] for c, v in zip(names, x, strict=True)})
        step = np.linalg.solve(information + np.diag(precision), score - precision * (x - centre))
        x += np.clip(step, -MAX_STEP, MAX_STEP)
        if np.max(np.abs(step)) < MIN_SCORING_STEP:
            break
    covariance = np.linalg.inv(information + np.diag(precision))
    alone = np.linalg.inv(information + np.eye(len(names)) / WIDE_LOG_VARIANCE_SD**2)
    return Components(
        theta,
        dict(zip(names, 0.5 * x, strict=True)),
        dict(zip(names, 0.5 * np.sqrt(np.diag(covariance)), strict=True)),
        dict(zip(names, 0.5 * np.sqrt(np.diag(alone)), strict=True)),
    )


def _inverse(o: Observation, theta: Mapping[str, FloatArray]) -> tuple[ComplexArray, dict[str, FloatArray]]:
    """Inverse of the expected density [F, n, n], and the density [F] of every noise."""
    noise = {c: theta[c] @ o.shapes[c] for c in o.gains}
    g = np.stack([np.sqrt(noise[c])[:, None] * g for c, g in o.gains.items()], axis=2)  # [F, n, c]
    total = np.asarray(g @ g.conj().transpose(0, 2, 1))
    ridge = 1e-12 * np.real(np.trace(total, axis1=1, axis2=2))[:, None, None] * np.eye(total.shape[1])
    return np.asarray(np.linalg.inv(total + ridge)), noise


def _sums(
    observations: Sequence[Observation], theta: Mapping[str, FloatArray]
) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Numerator and denominator [part] of a multiplicative step per noise."""
    up = {c: np.zeros_like(v) for c, v in theta.items()}
    down = {c: np.zeros_like(v) for c, v in theta.items()}
    for o in observations:
        inverse, _ = _inverse(o, theta)
        g = np.stack(list(o.gains.values()), axis=2)  # [F, n, c]
        h = inverse @ g
        observed = np.real(np.sum(h.conj() * (o.density @ h), axis=1))
        expected = np.real(np.sum(g.conj() * h, axis=1))
        for i, c in enumerate(o.gains):
            up[c] += o.averages * (o.shapes[c] @ observed[:, i])
            down[c] += o.averages * (o.shapes[c] @ expected[:, i])
    return up, down


def _score(observations: Sequence[Observation], theta: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Score [c] and information [c, c] of the logarithms of the variances of all noises."""
    names = list(theta)
    score, information = np.zeros(len(names)), np.zeros((len(names), len(names)))
    for o in observations:
        inverse, noise = _inverse(o, theta)
        present = [c for c in names if c in o.gains]
        index = [names.index(c) for c in present]
        g = np.stack([np.sqrt(noise[c])[:, None] * o.gains[c] for c in present], axis=2)
        h = inverse @ g
        cross = g.conj().transpose(0, 2, 1) @ h
        observed = np.real(np.sum(h.conj() * (o.density @ h), axis=1))
        score[index] += o.averages * np.sum(observed - np.real(np.einsum("fcc->fc", cross)), axis=0)
        information[np.ix_(index, index)] += o.averages * np.sum(np.abs(cross) ** 2, axis=0)
    return score, information
