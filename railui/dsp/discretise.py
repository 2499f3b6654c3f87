"""Discretisation of analog filters by the first-order hold, exact for input that is linear between samples."""

from __future__ import annotations

from itertools import zip_longest

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import ComplexArray, FloatArray

StateSpace = tuple[FloatArray, FloatArray, FloatArray, FloatArray]  # A, B, C, D

GAIN_FREQUENCIES = 40  # at which the gains of both forms are compared
MAX_GAIN_ANGLE = 3.0  # rad per sample, below the Nyquist frequency
EXPONENTIAL_TERMS = 14  # 0.25^14/14! is 4e-20


def discretise(zpk: tuple[ArrayLike, ArrayLike, float], dt: float) -> FloatArray:
    """Discretise an analog filter by the first-order hold.

    The whole cascade is exact for an input that is linear between samples: the poles are exp(p dt), up to two zeros at
    s = 0 stay at z = 1, and the other zeros are those of the sampled state space. Poles may coincide.

    Parameters
    ----------
    zpk : tuple
        Zeros and poles [1/s] and gain; stable, with no more zeros than poles.
    dt : float
        Sampling interval [s].

    Returns
    -------
    FloatArray
        Second-order sections [section, 6] (b0 b1 b2 1 a1 a2).

    Raises
    ------
    ValueError
        For an unstable or improper filter, and for an interval that is not positive.

    References
    ----------
    Franklin, Powell, Workman, Digital Control of Dynamic Systems, 6.3.

    Examples
    --------
    >>> discretise(([], [-2.0], 2.0), 0.1).round(4).tolist()  # 2/(s + 2)
    [[0.0937, 0.0876, 0.0, 1.0, -0.8187, 0.0]]
    """
    zeros, poles = (np.atleast_1d(np.asarray(roots, dtype=np.complex128)) for roots in zpk[:2])
    gain = float(zpk[2])
    if not 0 < dt < np.inf:
        raise ValueError(f"the sampling interval must be positive: {dt:g} s")
    if poles.size < max(zeros.size, 1) or np.any(poles.real >= 0):
        raise ValueError(f"a filter must be stable with no more zeros than poles: {zeros} over {poles}")
    system = first_order_hold(state_space(zeros, poles), dt)
    zeros_from_one = sampled_zeros(*system)  # sorted by distance from z = 1
    zeros_from_one[: min(2, int(np.sum(zeros == 0)))] = 0.0
    sampled_poles = np.exp(poles * dt)
    sampled_gain = gain * _gain(system, zeros_from_one, poles, dt)
    # scipy.signal would do this too, after an import of half a second
    numerators, denominators = _real_factors(1.0 + zeros_from_one), _real_factors(sampled_poles)
    sections = np.array(
        [
            np.pad([*top, *np.zeros(3 - top.size), *bottom], (0, 3 - bottom.size))
            for top, bottom in zip(numerators, denominators, strict=True)
        ]
    )
    sections[0, :3] *= sampled_gain
    return sections


def _gain(system: StateSpace, zeros_from_one: ComplexArray, poles: ComplexArray, dt: float) -> float:
    """Return the gain of the sampled zeros and poles, compared with the state space where its response is largest.

    The leading coefficient of the numerator alone would consist mostly of rounding errors.
    """
    a, b, c, d = system
    lowest, highest = np.min(np.abs(poles)), np.max(np.abs(poles))
    angle = np.minimum(np.geomspace(lowest, max(highest, 2 * lowest), GAIN_FREQUENCIES) * dt, MAX_GAIN_ANGLE)
    z, step = np.exp(1j * angle), np.expm1(1j * angle)
    exact = (c @ np.linalg.solve(step[:, None, None] * np.eye(len(a)) - a, b) + d)[:, 0, 0]
    unscaled = np.prod((step[:, None] - zeros_from_one) / (z[:, None] - np.exp(poles * dt)), axis=1)
    k = int(np.argmax(np.abs(exact)))
    return float((exact[k] / unscaled[k]).real)


def state_space(zeros: ComplexArray, poles: ComplexArray) -> StateSpace:
    """Return A, B, C, D of prod(s - zeros)/prod(s - poles) as sections in series, each scaled by its own frequency."""
    a, b = np.zeros((0, 0)), np.zeros((0, 1))
    c, d = np.zeros((1, 0)), np.ones((1, 1))
    for top, bottom in zip_longest(_real_factors(zeros), _real_factors(poles), fillvalue=np.ones(1)):
        order = bottom.size - 1
        w = abs(bottom[-1]) ** (1 / order)
        numerator = np.concatenate([np.zeros(order + 1 - top.size), top])
        direct = numerator[0]
        remainder = (numerator - direct * bottom)[1:][::-1]  # lowest power first
        section_a = np.eye(order, k=1) * w
        section_a[-1] = -bottom[1:][::-1] / w ** np.arange(order - 1, -1, -1)
        section_b = np.zeros((order, 1))
        section_b[-1] = w
        section_c = (remainder / w ** np.arange(order, 0, -1))[None, :]
        a = np.block([[a, np.zeros((len(a), order))], [section_b @ c, section_a]])
        b = np.vstack([b, section_b @ d])
        c, d = np.hstack([direct * c, section_c]), direct * d
    return a, b, c, d


def _real_factors(roots: ComplexArray) -> list[FloatArray]:
    """Return real polynomials of second order, and at most one of first order at the end, with these roots."""
    upper = roots[roots.imag > 0]
    real = np.sort(roots[roots.imag == 0].real)[::-1]
    if 2 * upper.size + real.size != roots.size:
        raise ValueError(f"complex roots must come in conjugate pairs: {roots}")
    factors = [np.array([1.0, -2 * root.real, abs(root) ** 2]) for root in upper]
    factors += [np.poly(real[i : i + 2]) for i in range(0, real.size, 2)]
    return factors


def first_order_hold(system: StateSpace, dt: float) -> StateSpace:
    """Return A - 1, B, C, D from sample to sample for input linear between samples; the state is x - G1 u."""
    a, b, c, d = system
    n = len(a)
    ramp = np.zeros((n + 2, n + 2))
    ramp[:n, :n], ramp[:n, n : n + 1], ramp[n, n + 1] = a * dt, b * dt, 1.0
    step = matrix_exponential(ramp)
    transition, hold, slope = step[:n, :n], step[:n, n : n + 1], step[:n, n + 1 :]
    return transition - np.eye(n), hold + (transition - np.eye(n)) @ slope, c, d + c @ slope


def matrix_exponential(matrix: FloatArray) -> FloatArray:
    """Return exp(A), by its series for A/2^k and k squarings; scipy.linalg takes a quarter of a second to import."""
    halvings = max(0, int(np.frexp(4.0 * np.linalg.norm(matrix, 1))[1]))
    scaled = matrix / 2.0**halvings
    total = term = np.eye(len(matrix))
    for k in range(1, EXPONENTIAL_TERMS):
        term = term @ scaled / k
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total


def sampled_zeros(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> ComplexArray:
    """Return the zeros of a sampled system (A - 1, B, C, D) as distances z - 1, smallest first.

    They are the points z where the system pencil is singular. The eigenvalue problem is shifted to z = 2, where the
    pencil is regular: the samples of a stable filter have no zero there.
    """
    n = len(a)
    pencil = np.block([[a - np.eye(n), b], [c, d]])
    zeros = 1.0 + 1.0 / np.linalg.eigvals(np.linalg.inv(pencil)[:n, :n]).astype(np.complex128)
    real, upper = zeros[zeros.imag == 0].real, zeros[zeros.imag > 0]
    zeros = np.concatenate([real, upper, upper.conj()])
    return np.asarray(zeros[np.argsort(np.abs(zeros), kind="stable")], dtype=np.complex128)
