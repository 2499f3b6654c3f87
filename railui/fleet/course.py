"""Course of a change: onset, growth rate, and the day at which a limit is reached, with intervals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import special

from railui.arrays import FloatArray

QUANTILE: Final = 1.6449  # of a 90 % interval
PROFILE: Final = QUANTILE**2  # increase of the sum of squares at the ends of a 90 % interval
GRID: Final = 600  # onsets that are tried
DRAWS: Final = 2000


@dataclass(frozen=True)
class Course:
    """Course of a quantity y = base + rate max(0, t - onset).

    Attributes
    ----------
    onset, onset_low, onset_high
        Days, 90 % interval.
    rate, rate_sd
        Growth per day.
    now, now_sd
        Change so far.
    onsets, weights
        Onsets [n] that were tried, and their likelihood.
    rates, rate_sds, bases
        Rates, their standard deviations, and bases [n] of these onsets.
    couplings, base_sd
        Fall of the base per rate [n], and its standard deviation where the rate is known.
    probability
        Of a misfit at least as large, if the values follow a ramp.
    """

    onset: float
    onset_low: float
    onset_high: float
    rate: float
    rate_sd: float
    now: float
    now_sd: float
    onsets: FloatArray
    weights: FloatArray
    rates: FloatArray
    rate_sds: FloatArray
    bases: FloatArray
    couplings: FloatArray
    base_sd: float
    probability: float


@dataclass(frozen=True)
class Arrival:
    """Day at which a limit is reached: median and 90 % interval; infinite where it is not."""

    day: float
    low: float
    high: float
    probability: float


def fit_course(t: FloatArray, y: FloatArray, sd: FloatArray, base_sd: float = 0.0) -> Course | None:
    """Fit a ramp to deviations from the expected value, whose mean before the onset is a base of about zero.

    Parameters
    ----------
    t : array [n]
        Days, increasing.
    y, sd : array [n]
        Deviations and their standard deviations.
    base_sd : float
        Standard deviation of the base: of the level that the deviations refer to.

    Returns
    -------
    Course or None
        None for fewer than three values.

    Notes
    -----
    For every onset base and rate follow by weighted least squares, the base with a normal prior; the onsets are
    weighted by their profile likelihood, exp(-S / 2 s^2), and those with S - S_min <= 1.645^2 s^2 make the interval
    (Y. Pawitan, In All Likelihood, Oxford 2001, ch. 3). The standard deviation of the rate adds what the onset
    leaves open.
    """
    known = np.isfinite(y) & np.isfinite(sd) & (sd > 0.0)
    t, y, sd = t[known], y[known], sd[known]
    if len(t) < 3:
        return None
    onsets = np.linspace(t[0], t[-1], GRID, endpoint=False)
    ramps = np.maximum(t - onsets[:, None], 0.0)
    weight = 1.0 / sd**2
    base_variance = 1.0 / (weight.sum() + 1.0 / base_sd**2) if base_sd > 0.0 else 0.0
    couplings = base_variance * (ramps @ weight)
    information = ramps**2 @ weight - couplings * (ramps @ weight)
    rates = (ramps @ (weight * y) - couplings * (weight @ y)) / np.maximum(information, 1e-300)
    bases = base_variance * (weight @ y) - couplings * rates
    squares = np.sum(((y - rates[:, None] * ramps - bases[:, None]) / sd) ** 2, axis=1)
    squares += (bases / base_sd) ** 2 if base_sd > 0.0 else 0.0
    noise = max(float(squares.min()) / max(len(t) - 2, 1), 1.0)
    weights = np.exp(-0.5 * (squares - squares.min()) / noise)
    weights /= weights.sum()
    best = int(np.argmin(squares))
    inside = onsets[squares <= squares.min() + PROFILE * noise]
    sds = np.sqrt(noise / np.maximum(information, 1e-300))
    mean = float(weights @ rates)
    rate_sd = float(np.sqrt(weights @ (sds**2 + (rates - mean) ** 2)))
    spans = t[-1] - onsets
    nows = rates * spans
    now_sd = float(np.sqrt(weights @ ((sds * spans) ** 2 + (nows - weights @ nows) ** 2)))
    return Course(
        float(onsets[best]),
        float(inside[0]),
        float(inside[-1]),
        float(rates[best]),
        rate_sd,
        float(nows[best]),
        now_sd,
        onsets,
        weights,
        rates,
        sds,
        bases,
        couplings,
        float(np.sqrt(noise * base_variance)),
        float(special.chdtrc(len(t) - 2, squares.min())),
    )


def arrival(course: Course, low: float, high: float, seed: int = 0) -> Arrival:
    """Day at which a change has grown to a limit, if it goes on as it has.

    Parameters
    ----------
    low, high
        Changes from the expected value at which a limit is reached, negative and positive; infinite without one.

    Notes
    -----
    Onset and rate are drawn from their joint likelihood; the interval holds 90 % of the days.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, 71]))
    at = rng.choice(len(course.onsets), size=DRAWS, p=course.weights)
    excess = course.rate_sds[at] * rng.standard_normal(DRAWS)
    rates = course.rates[at] + excess
    bases = course.bases[at] - course.couplings[at] * excess + course.base_sd * rng.standard_normal(DRAWS)
    with np.errstate(divide="ignore"):
        durations = np.where(rates > 0.0, (high - bases) / rates, np.where(rates < 0.0, (low - bases) / rates, np.inf))
    days = course.onsets[at] + durations
    low, middle, high = np.quantile(days, [0.05, 0.5, 0.95], method="nearest")
    return Arrival(float(middle), float(low), float(high), float(np.mean(np.isfinite(days))))
