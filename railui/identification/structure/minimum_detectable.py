"""Minimum detectable effects of a campaign, at a nominal power of 90 %."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from scipy import special

from railui import core
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.gain_forecast import PredictedGain, PredictedGains
from railui.identification.structure.score_test import ScoreTestResult
from railui.vehicle.design import Design
from railui.vehicle.effects import parameter_unit, range_at

NOMINAL_POWER = 0.9
POWER_QUANTILE = float(special.ndtri(NOMINAL_POWER))  # of the normal distribution
MIN_LOG_SLOPE = 0.1  # of the amount over the parameter, below which no parameter is detectable
# log of the parameter beyond the weakest simulated shape, and beyond the strongest, where an effect is far from linear
MAX_WEAKER_EXTRAPOLATION = float(np.log(10.0))
MAX_STRONGER_EXTRAPOLATION = float(np.log(2.0))


class Score(Protocol):
    """Score of one shape of a candidate, measured or expected."""

    @property
    def candidate(self) -> Candidate:
        """The candidate."""

    @property
    def shape(self) -> int:
        """Number of the shape."""

    @property
    def norm(self) -> float:
        """Squared length of the output difference that the estimated parameters leave."""

    @property
    def unabsorbed_share(self) -> float:
        """Share of the squared length that they leave."""

    def detectable_amount(self, critical: float, power_quantile: float) -> float:
        """Return the amount whose score exceeds a critical one with the power of a quantile."""


def minimum_detectable_amount(
    score: Score, test: ScoreTestResult, min_relative_gain: float, nrmse: float, predicted_gains: PredictedGains
) -> float:
    """Return the amount of a shape that meets both criteria: family-wise score and minimum relative gain.

    nrmse: error on the validation runs; predicted_gains: gain there by candidate and shape, to first order.
    """
    settings, gain = test.settings, 1.0 / (1.0 - min_relative_gain) ** 2 - 1.0
    amounts = [score.detectable_amount(test.critical_score, POWER_QUANTILE)]
    predicted = predicted_gains.get((score.candidate, score.shape))
    # an effect that calibration almost absorbs gains little on the estimation runs, and much at another speed
    if score.unabsorbed_share >= settings.min_remaining_share or not predicted:
        amounts.append(settings.estimation_gain_margin * float(np.sqrt(gain * test.rss / score.norm)))
    if predicted:
        amounts.append(settings.absorption_margin * amount_of_gain(predicted, gain * nrmse**2))
    return max(amounts)


def amount_of_gain(predicted: PredictedGain, gain: float) -> float:
    """Return the amount that adds a gain to the NRMSE^2 of the validation runs in 90 % of all cases.

    Of an amount a the squared error rises by a^2 D + 2 a c: D scatters about its prediction (log-normal), c is the
    product of the effect with noise. The gain of the nine tenths, a^2 D_low - 2 a q s_c, is solved for a.
    """
    low = max(predicted.mean * float(np.exp(-POWER_QUANTILE * predicted.scatter)), 1e-300)
    noise = POWER_QUANTILE * predicted.noise_sd
    return float((noise + np.sqrt(noise**2 + low * gain)) / low)


def minimum_detectable_effects(
    test: ScoreTestResult, min_relative_gain: float, nrmse: float, predicted_gains: PredictedGains
) -> list[dict[str, Any]]:
    """Return one row per kind, location and wheelset: parameter, minimum detectable value (None: unknown), unit, power.

    nrmse: error of the final model on the validation runs; predicted_gains: gain there by candidate and shape.
    """

    def amount(score: Score) -> float:
        return minimum_detectable_amount(score, test, min_relative_gain, nrmse, predicted_gains)

    return detectable_rows(test.results, amount)


def without_unphysical_sizes(rows: Sequence[Mapping[str, Any]], design: Design) -> list[dict[str, Any]]:
    """Return rows whose value is None where it exceeds the range of the catalogue: no such effect is detectable."""
    values = design.values_with_sites
    limited = []
    for row in rows:
        parameter = next(p for p in core.effect_record(row["kind"])["parameters"] if p["key"] == row["parameter"])
        _, high = range_at(parameter, row["at"], values)
        is_beyond = row["value"] is not None and abs(row["value"]) > high
        limited.append({**row, "value": None, "with": {}} if is_beyond else dict(row))
    return limited


def detectable_rows(results: Sequence[Score], amount: Callable[[Score], float]) -> list[dict[str, Any]]:
    """Return one row per kind, location and wheelset from the minimum detectable amount of every shape."""
    by_candidate: dict[Candidate, list[Score]] = {}
    for score in results:
        by_candidate.setdefault(score.candidate, []).append(score)
    rows = []
    for candidate, scores in by_candidate.items():
        key, value, shape = _minimum_value(candidate, scores, amount)
        parameter = next(p for p in core.effect_record(candidate.kind)["parameters"] if p["key"] == key)
        rows.append(
            {
                "kind": candidate.kind,
                "at": candidate.at,
                "wheelset": candidate.wheelset,
                "parameter": key,
                "value": value,
                "unit": parameter_unit(parameter, candidate.at),
                "power": NOMINAL_POWER,
                "with": {k: x for k, x in _scaled(candidate, shape, key, value).items() if k != key},
            }
        )
    return rows


def _minimum_value(
    candidate: Candidate, scores: list[Score], amount: Callable[[Score], float]
) -> tuple[str, float | None, Mapping[str, Any]]:
    """Return the key of a parameter of the candidate, its minimum detectable value and the shape for which it holds."""
    amounts = [amount(score) for score in scores]
    shapes = [candidate.shapes[score.shape] for score in scores]
    if (key := candidate.strength) is not None:
        values = [float(a * abs(shape[key])) for a, shape in zip(amounts, shapes, strict=True)]
        best = int(np.argmin(values))
        return key, values[best], shapes[best]
    record = core.effect_record(candidate.kind)
    key = str(record["parameters"][0]["key"])
    if record["acts"] == "sensor":
        neutral = 1.0 if key == "gain" else 0.0
        return key, float(neutral + amounts[0] * (candidate.shapes[0][key] - neutral)), {}
    sizes = [float(np.sqrt(score.norm / max(score.unabsorbed_share, 1e-300))) for score in scores]
    return key, value_of_unit_amount(shapes, amounts, key, sizes), shapes[0]


def _scaled(candidate: Candidate, shape: Mapping[str, Any], key: str, value: float | None) -> Mapping[str, Any]:
    """Return the shape with the forces that scale with the strength at its minimum detectable value."""
    if key != candidate.strength or value is None or not shape[key]:
        return shape
    return candidate.scale_force(shape, value / abs(shape[key]))


def value_of_unit_amount(
    shapes: Sequence[Mapping[str, Any]], amounts: Sequence[float], key: str, sizes: Sequence[float] = ()
) -> float | None:
    """Return the parameter at which the full effect (amount 1) is just detectable, None where there is none.

    Log-log interpolation between the simulated shapes that differ in this parameter alone, from the weakest shape on;
    extrapolation by at most a factor of 10 below the weakest, and of 2 above the strongest. The amount need not fall
    all the way from the weakest shape to the strongest: of a large clearance the estimated stiffness absorbs more than
    of a small one.

    sizes: lengths of the output differences, before anything is absorbed, which order the shapes by strength; without
    them the end with the smaller amount is the stronger.
    """
    others = [tuple(value for k, value in shape.items() if k != key) for shape in shapes]
    comparable = [i for i, other in enumerate(others) if other == others[0]]
    if len(comparable) < 2:
        return None
    comparable.sort(key=lambda i: shapes[i][key])
    strength = sizes or [1.0 / a for a in amounts]
    if strength[comparable[-1]] < strength[comparable[0]]:
        comparable.reverse()
    x = np.log([shapes[i][key] for i in comparable])
    y = np.log([amounts[i] for i in comparable])
    i = next((k for k in range(len(x)) if y[k] <= 0.0), len(x) - 1)
    near, far = (i, i + 1) if i == 0 else (i, i - 1)
    slope = (y[far] - y[near]) / (x[far] - x[near])
    is_outside = i == 0 or y[i] > 0.0
    if is_outside and (abs(slope) < MIN_LOG_SLOPE or (y[far] < y[near]) != (y[near] <= 0.0)):
        return None
    step = -y[near] / slope
    limit = MAX_WEAKER_EXTRAPOLATION if i == 0 else MAX_STRONGER_EXTRAPOLATION
    return None if is_outside and abs(step) > limit else float(np.exp(x[near] + step))
