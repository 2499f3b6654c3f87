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
    names = list(start)
    stacks = _stacked(observations, names)
    theta, weights = _padded(start, names), _padded(level, names)
    for _ in range(MAX_ITERATIONS):
        before = np.sum(weights * theta, axis=1)
        up, down = _sums(stacks, theta)
        theta = theta * np.sqrt(up / np.maximum(down, 1e-300))
        after = np.sum(weights * theta, axis=1)
        if np.max(np.abs(after - before) / np.maximum(before, 1e-300)) < MIN_LEVEL_CHANGE:
            break
    squared_levels = np.maximum(np.sum(weights * theta, axis=1), 1e-300)
    centre = np.array([2.0 * prior[c][0] for c in names]) - np.log(squared_levels)
    precision = np.array([1.0 / (2.0 * prior[c][1]) ** 2 for c in names])
    x = np.zeros(len(names))
    for _ in range(MAX_SCORING_STEPS):
        score, information = _score(stacks, np.exp(x)[:, None] * theta)
        step = np.linalg.solve(information + np.diag(precision), score - precision * (x - centre))
        x += np.clip(step, -MAX_STEP, MAX_STEP)
        if np.max(np.abs(step)) < MIN_SCORING_STEP:
            break
    covariance = np.linalg.inv(information + np.diag(precision))
    alone = np.linalg.inv(information + np.eye(len(names)) / WIDE_LOG_VARIANCE_SD**2)
    return Components(
        {c: theta[i, : len(start[c])] for i, c in enumerate(names)},
        dict(zip(names, 0.5 * x, strict=True)),
        dict(zip(names, 0.5 * np.sqrt(np.diag(covariance)), strict=True)),
        dict(zip(names, 0.5 * np.sqrt(np.diag(alone)), strict=True)),
    )


@dataclass(frozen=True, eq=False)
class _Stack:
    """Observations of as many combinations n each, one after the other along the frequencies F.

    density [F, n, n], gains [F, n, channel] (zero where a channel is absent), shapes [channel, part, F], averages [F].
    """

    density: ComplexArray
    gains: ComplexArray
    shapes: FloatArray
    averages: FloatArray


def _stacked(observations: Sequence[Observation], names: Sequence[str]) -> list[_Stack]:
    parts = max(len(s) for o in observations for s in o.shapes.values())
    by_size: dict[int, list[Observation]] = {}
    for o in observations:
        by_size.setdefault(o.density.shape[1], []).append(o)
    stacks = []
    for some in by_size.values():
        gains, shapes = [], []
        for o in some:
            gain = np.zeros((*o.density.shape[:2], len(names)), dtype=np.complex128)
            shape = np.zeros((len(names), parts, len(o.density)))
            for c, g in o.gains.items():
                gain[:, :, names.index(c)] = g
                shape[names.index(c), : len(o.shapes[c])] = o.shapes[c]
            gains.append(gain)
            shapes.append(shape)
        averages = np.concatenate([np.full(len(o.density), o.averages) for o in some])
        density = np.concatenate([o.density for o in some])
        stacks.append(_Stack(density, np.concatenate(gains), np.concatenate(shapes, axis=2), averages))
    return stacks


def _padded(values: Mapping[str, FloatArray], names: Sequence[str]) -> FloatArray:
    """Values [part] of every name as an array [name, part], with zeros for parts that a name lacks."""
    out = np.zeros((len(names), max(len(v) for v in values.values())))
    for i, c in enumerate(names):
        out[i, : len(values[c])] = values[c]
    return out


def _inverse(o: _Stack, theta: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Inverse of the expected density [F, n, n], and the density [F, channel] of every noise."""
    noise = np.einsum("cp,cpf->fc", theta, o.shapes)
    g = np.sqrt(noise)[:, None] * o.gains
    total = np.asarray(g @ g.conj().transpose(0, 2, 1))
    ridge = 1e-12 * np.real(np.trace(total, axis1=1, axis2=2))[:, None, None] * np.eye(total.shape[1])
    return np.asarray(np.linalg.inv(total + ridge)), noise


def _sums(stacks: Sequence[_Stack], theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator [channel, part] of a multiplicative step."""
    up, down = np.zeros_like(theta), np.zeros_like(theta)
    for o in stacks:
        inverse, _ = _inverse(o, theta)
        h = inverse @ o.gains
        observed = o.averages[:, None] * np.real(np.sum(h.conj() * (o.density @ h), axis=1))
        expected = o.averages[:, None] * np.real(np.sum(o.gains.conj() * h, axis=1))
        up += np.einsum("cpf,fc->cp", o.shapes, observed)
        down += np.einsum("cpf,fc->cp", o.shapes, expected)
    return up, down


def _score(stacks: Sequence[_Stack], theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Score [c] and information [c, c] of the logarithms of the variances of all noises."""
    score, information = np.zeros(len(theta)), np.zeros((len(theta), len(theta)))
    for o in stacks:
        inverse, noise = _inverse(o, theta)
        g = np.sqrt(noise)[:, None] * o.gains
        h = inverse @ g
        cross = g.conj().transpose(0, 2, 1) @ h
        observed = np.real(np.sum(h.conj() * (o.density @ h), axis=1))
        score += o.averages @ (observed - np.real(np.einsum("fcc->fc", cross)))
        information += np.einsum("f,fcd->cd", o.averages, np.abs(cross) ** 2)
    return score, information
