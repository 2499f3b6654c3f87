"""Track as sums of harmonics, ERRI B176 spectra and a gauge deviation, met at a varying speed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from tests.truth.laws import Array
from tests.truth.road import Table

# ERRI B176, one-sided, per rad/m
W_C, W_R, W_S, HALF_GAUGE = 0.8246, 0.0206, 0.4380, 0.75
LATERAL = {"low": 2.119e-7, "high": 6.125e-7}
VERTICAL = {"low": 4.032e-7, "high": 1.080e-6}
QUANTITY = {"yw": 0, "phiw": 1, "gauge": 2}
Spectrum = Callable[[Array], Array]


def lateral(W: Array, level: str = "low") -> Array:
    """Lateral deviation of the centre line, S(W) [m^2/(rad/m)]."""
    return LATERAL[level] * W_C**2 / ((W**2 + W_R**2) * (W**2 + W_C**2))


def cross_level(W: Array, level: str = "low") -> Array:
    """Cross-level angle, S(W) [rad^2/(rad/m)]."""
    rest = (W**2 + W_R**2) * (W**2 + W_C**2) * (W**2 + W_S**2)
    return VERTICAL[level] / HALF_GAUGE**2 * W_C**2 * W**2 / rest


def gauge(W: Array) -> Array:
    """Gauge deviation: the lateral's slope with a corner at 60 m, 1.2 mm between 3 and 70 m (own)."""
    return 2.02e-7 * W_C**2 / ((W**2 + 0.1**2) * (W**2 + W_C**2))


@dataclass(frozen=True)
class Harmonics:
    """Sum of A_k cos(W_k s + phase_k), W_k = 2 pi k/length: a track quantity, periodic in `length` [m]."""

    length: float
    k: Array
    amplitude: Array
    phase: Array

    def __call__(self, s: Array) -> Array:
        """The sum itself, term by term: slow and exact."""
        total = np.zeros(len(s))
        for k, amplitude, phase in zip(self.k, self.amplitude, self.phase, strict=True):
            total += amplitude * np.cos(2.0 * np.pi * k / self.length * s + phase)
        return total

    def along(self, s: Array, spacing: float = 0.05) -> Array:
        """The same by a Fourier transform on a fine grid and a spline through it."""
        n = round(self.length / spacing)
        lines = np.zeros(n // 2 + 1, complex)
        lines[self.k.astype(int)] = 0.5 * n * self.amplitude * np.exp(1j * self.phase)
        one = np.fft.irfft(lines, n)
        grid = np.arange(n + 1) * (self.length / n)
        return CubicSpline(grid, np.append(one, one[0]), bc_type="periodic")(s)

    @property
    def sd(self) -> float:
        """Standard deviation over a whole period."""
        return float(np.sqrt(0.5 * (self.amplitude**2).sum()))


def harmonics(
    S: Spectrum, length: float, seed: int, quantity: int, shortest: float = 3.0, longest: float = 150.0
) -> Harmonics:
    """Harmonics of a spectrum inside a band of wavelengths [m]: amplitude sqrt(2 S dW), seeded phases."""
    k = np.arange(np.ceil(length / longest), np.floor(length / shortest) + 1)
    dW = 2.0 * np.pi / length
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, quantity])))
    return Harmonics(length, k, np.sqrt(2.0 * S(k * dW) * dW), rng.uniform(0.0, 2.0 * np.pi, len(k)))


def quantities(level: str, length: float, seed: int, scale: float = 1.0) -> dict[str, Harmonics]:
    """Lateral deviation, cross-level and gauge of a B176 track, `level` low or high."""

    def one(name: str, S: Spectrum, **band: float) -> Harmonics:
        return harmonics(lambda W: scale**2 * S(W), length, seed, QUANTITY[name], **band)

    return {
        "yw": one("yw", lambda W: lateral(W, level)),
        "phiw": one("phiw", lambda W: cross_level(W, level)),
        "gauge": one("gauge", gauge, longest=70.0),
    }


def speed_profile(mean: float, t: Array, rng: np.random.Generator, spread: float = 1.15) -> tuple[Array, Array]:
    """Speed [m/s] that wanders round its mean below 0.5 m/s^2, and its exact integral [m] from t = 0."""
    period = np.array([1.0, 0.5, 0.3]) * rng.uniform(0.8, 1.2, 3) * max(float(t[-1]), 30.0)
    omega, phase = 2.0 * np.pi / period, rng.uniform(0.0, 2.0 * np.pi, 3)
    share = np.array([1.0, 0.8, 0.4])
    amplitude = spread * np.sqrt(2.0) * share / np.sqrt((share**2).sum())
    amplitude /= max(1.0, float((amplitude * omega).sum()) / 0.5)
    angle = omega * t[:, None] + phase
    v = mean + (amplitude * np.cos(angle)).sum(axis=1)
    return v, mean * t + (amplitude / omega * (np.sin(angle) - np.sin(phase))).sum(axis=1)


def met(
    mean: float,
    seconds: float,
    seed: int,
    level: str = "low",
    scale: float = 1.0,
    rate: float = 200.0,
    before: float = 0.0,
    spread: float = 1.15,
) -> Table:
    """A run at about `mean` [m/s] over its own B176 track, with `before` seconds ahead of t = s = 0."""
    t = np.arange(-round(before * rate), round(seconds * rate)) / rate
    v, s = speed_profile(mean, t, np.random.default_rng([seed, 3]), spread)
    length = 100.0 * np.ceil((s[-1] - s[0] + 50.0) / 100.0)
    rails = {name: one.along(s - s[0]) for name, one in quantities(level, length, seed, scale).items()}
    return Table(t, s, v, rails["yw"], rails["phiw"], rails["gauge"])


def eased(run: Table, length: float) -> Table:
    """The run with its track level for `length` [m], then rising smoothly over as much again.

    What the trailing wheelset meets then starts without a jump of its rate, and steps keep their order.
    """
    x = np.clip((run.s - run.s[0]) / length - 1.0, 0.0, 1.0)
    rise = x - np.sin(2.0 * np.pi * x) / (2.0 * np.pi)
    return replace(run, yw=rise * run.yw, phiw=rise * run.phiw, gauge=rise * run.gauge)


def recorder_noise(s: Array, sd: float, shortest: float, rng: np.random.Generator) -> Array:
    """Noise of a track column: white in s at wavelengths above `shortest` [m], nothing below, `sd` in all."""
    length = float(s[-1] - s[0]) + 10.0
    k = np.arange(1.0, np.floor(length / shortest) + 1.0)
    each = np.hypot(*rng.normal(0.0, 1.0, (2, len(k)))) * sd / np.sqrt(len(k))
    return Harmonics(length, k, each, rng.uniform(0.0, 2.0 * np.pi, len(k))).along(s - s[0])
