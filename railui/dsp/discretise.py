"""A filter for samples: second-order sections that are exact for an input linear between its samples."""

from __future__ import annotations

from itertools import zip_longest

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import ComplexArray, FloatArray

System = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


def discretise(zpk: tuple[ArrayLike, ArrayLike, float], dt: float) -> FloatArray:
    """Second-order sections [n, 6] (b0 b1 b2 1 a1 a2) of an analog filter sampled every `dt` [s].

    `zpk`: zeros and poles [1/s] and gain, stable and with no more zeros than poles. The whole cascade is
    exact for an input that is linear between samples (first-order hold): the poles are exp(p dt), a zero at
    s = 0 stays at z = 1, up to two of them; the other zeros are those of the sampled state space. Poles may
    coincide. Raises ValueError for an unstable or improper filter. Source: Franklin, Powell, Workman,
    Digital Control of Dynamic Systems, 6.3.

    >>> discretise(([], [-2.0], 2.0), 0.1).round(4).tolist()  # 2/(s + 2)
    [[0.0937, 0.0876, 0.0, 1.0, -0.8187, 0.0]]
    """
    zeros, poles = (np.atleast_1d(np.asarray(roots, dtype=np.complex128)) for roots in zpk[:2])
    gain = float(zpk[2])
    if not 0 < dt < np.inf:
        raise ValueError(f"the interval of samples must be positive: {dt:g} s")
    if poles.size < max(zeros.size, 1) or np.any(poles.real >= 0):
        raise ValueError(f"a filter must be stable with no more zeros than poles: {zeros} over {poles}")
    a, b, c, d = _held(_state_space(zeros, poles), dt)
    at_one = min(2, int(np.sum(zeros == 0)))
    around = _zeros_from_one(a, b, c, d)
    around[:at_one] = 0.0  # sorted by distance from z = 1

    # the gain by comparison where the response is greatest: the leading coefficient alone is mostly rounding
    slowest, fastest = np.min(np.abs(poles)), np.max(np.abs(poles))
    turns = np.minimum(np.geomspace(slowest, max(fastest, 2 * slowest), 40) * dt, 3.0)
    z = np.exp(1j * turns)
    step = np.expm1(1j * turns)
    true = (c @ np.linalg.solve(step[:, None, None] * np.eye(len(a)) - a, b) + d)[:, 0, 0]
    held_poles = np.exp(poles * dt)
    raw = np.prod((step[:, None] - around) / (z[:, None] - held_poles), axis=1)
    k = int(np.argmax(np.abs(true)))
    held_gain = float(gain * (true[k] / raw[k]).real)
    # scipy.signal would do this too, at half a second for reading it
    tops, bottoms = _real_factors(1.0 + around), _real_factors(held_poles)
    sections = np.array(
        [
            np.pad([*top, *np.zeros(3 - top.size), *bottom], (0, 3 - bottom.size))
            for top, bottom in zip(tops, bottoms, strict=True)
        ]
    )
    sections[0, :3] *= held_gain
    return sections


def _state_space(zeros: ComplexArray, poles: ComplexArray) -> System:
    """A, B, C, D of prod(s - zeros)/prod(s - poles): sections in series, each scaled by its own frequency."""
    a, b = np.zeros((0, 0)), np.zeros((0, 1))
    c, d = np.zeros((1, 0)), np.ones((1, 1))
    for top, bottom in zip_longest(_real_factors(zeros), _real_factors(poles), fillvalue=np.ones(1)):
        order = bottom.size - 1
        w = abs(bottom[-1]) ** (1 / order)
        numerator = np.concatenate([np.zeros(order + 1 - top.size), top])
        direct = numerator[0]
        rest = (numerator - direct * bottom)[1:][::-1]  # lowest power first
        own_a = np.eye(order, k=1) * w
        own_a[-1] = -bottom[1:][::-1] / w ** np.arange(order - 1, -1, -1)
        own_b = np.zeros((order, 1))
        own_b[-1] = w
        own_c = (rest / w ** np.arange(order, 0, -1))[None, :]
        a = np.block([[a, np.zeros((len(a), order))], [own_b @ c, own_a]])
        b = np.vstack([b, own_b @ d])
        c, d = np.hstack([direct * c, own_c]), direct * d
    return a, b, c, d


def _real_factors(roots: ComplexArray) -> list[FloatArray]:
    """Polynomials of second order, and at most one of first order at the end, that have these roots."""
    upper = roots[roots.imag > 0]
    real = np.sort(roots[roots.imag == 0].real)[::-1]
    if 2 * upper.size + real.size != roots.size:
        raise ValueError(f"complex roots must come in conjugate pairs: {roots}")
    factors = [np.array([1.0, -2 * root.real, abs(root) ** 2]) for root in upper]
    factors += [np.poly(real[i : i + 2]) for i in range(0, real.size, 2)]
    return factors


def _held(system: System, dt: float) -> System:
    """A - 1, B, C, D from sample to sample for an input linear between them (the state is x - G1 u)."""
    a, b, c, d = system
    n = len(a)
    ramp = np.zeros((n + 2, n + 2))
    ramp[:n, :n], ramp[:n, n : n + 1], ramp[n, n + 1] = a * dt, b * dt, 1.0
    step = _exponential(ramp)
    moved, hold, slope = step[:n, :n], step[:n, n : n + 1], step[:n, n + 1 :]
    return moved - np.eye(n), hold + (moved - np.eye(n)) @ slope, c, d + c @ slope


def _exponential(matrix: FloatArray) -> FloatArray:
    """exp(A), by its series for A/2^k and k squarings; scipy.linalg would take a quarter of a second to read."""
    halvings = max(0, int(np.frexp(4.0 * np.linalg.norm(matrix, 1))[1]))
    small = matrix / 2.0**halvings
    total = term = np.eye(len(matrix))
    for k in range(1, 14):  # 0.25^14/14! is 4e-20
        term = term @ small / k
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total


def _zeros_from_one(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> ComplexArray:
    """The zeros as distances z - 1, nearest first: where the pencil of the system is singular.

    Looked at from z = 2, where no zero of a stable filter's samples lies: there the pencil has an inverse.
    """
    n = len(a)
    pencil = np.block([[a - np.eye(n), b], [c, d]])
    found = 1.0 + 1.0 / np.linalg.eigvals(np.linalg.inv(pencil)[:n, :n]).astype(np.complex128)
    real, above = found[found.imag == 0].real, found[found.imag > 0]
    found = np.concatenate([real, above, above.conj()])
    return np.asarray(found[np.argsort(np.abs(found), kind="stable")], dtype=np.complex128)
