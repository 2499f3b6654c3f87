"""What a campaign could have shown: the smallest of every effect that the same test finds with 90 % power."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from railui import core
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.evidence import ScoreResult
from railui.identification.structure.gain_forecast import PredictedGains
from railui.identification.structure.projection import VANISHED
from railui.identification.structure.score_test import POWER, ScoreTestResult
from railui.vehicle.effect_reader import unit_of

CHANCE = 0.9
MARGIN = 1.4  # the gain scatters about what is foreseen, and a fit takes more of an effect than its first order


def smallest_amount(
    s: ScoreResult, trace: ScoreTestResult, material: float, rest: float, foreseen: PredictedGains
) -> float:
    """Amount of a shape that passes both gates: the family-wise score, and the material gain on the validating runs."""
    gain = 1.0 / (1.0 - material) ** 2 - 1.0
    amounts = [s.amount_seen(trace.critical + POWER)]
    added = foreseen.get((s.candidate, s.shape))
    # what adjusting absorbs nearly whole gains little where it was adjusted, and much at another speed
    if s.own >= VANISHED or not added:
        amounts.append(MARGIN * float(np.sqrt(gain * trace.rss / s.norm)))
    if added:
        amounts.append(MARGIN * float(np.sqrt(gain * rest**2 / added)))
    return max(amounts)


def detectable(trace: ScoreTestResult, material: float, rest: float, foreseen: PredictedGains) -> list[dict[str, Any]]:
    """One row per kind, place and wheelset: parameter, its smallest value, unit, power; value null where unknown.

    rest: nrmse of the vehicle as found on the validating runs; foreseen: what of it every candidate would add.
    """

    def amount(s: ScoreResult) -> float:
        return smallest_amount(s, trace, material, rest, foreseen)

    rows = []
    by_candidate: dict[Candidate, list[ScoreResult]] = {}
    for s in trace.results:
        by_candidate.setdefault(s.candidate, []).append(s)
    for candidate, seen in by_candidate.items():
        key, value = _smallest(candidate, seen, amount)
        record = core.record(candidate.kind)
        parameter = next(p for p in record["parameters"] if p["key"] == key)
        rows.append(
            {
                "kind": candidate.kind,
                "at": candidate.at,
                "wheelset": candidate.wheelset,
                "parameter": key,
                "value": value,
                "unit": unit_of(parameter, candidate.at),
                "power": CHANCE,
            }
        )
    return rows


def _smallest(
    candidate: Candidate, seen: list[ScoreResult], amount: Callable[[ScoreResult], float]
) -> tuple[str, float | None]:
    key = candidate.strength
    amounts = [amount(s) for s in seen]
    if key is not None:
        return key, float(min(a * abs(candidate.shapes[s.shape][key]) for a, s in zip(amounts, seen, strict=True)))
    record = core.record(candidate.kind)
    key = str(record["parameters"][0]["key"])
    if record["acts"] == "sensor":
        neutral = 1.0 if key == "gain" else 0.0
        return key, float(neutral + amounts[0] * (candidate.shapes[0][key] - neutral))
    return key, _crossing([candidate.shapes[s.shape] for s in seen], amounts, key)


def _crossing(shapes: list[Any], amounts: list[float], key: str) -> float | None:
    """The parameter at which the whole effect is just enough: log-log between (or beyond) the shapes that were run."""
    others = [tuple(v for k, v in s.items() if k != key) for s in shapes]
    same = [i for i, o in enumerate(others) if o == others[0]]
    x = np.log([shapes[i][key] for i in same])
    y = np.log([amounts[i] for i in same])
    order = np.argsort(x)
    x, y = x[order], y[order]
    if len(x) < 2:
        return None
    for i in range(len(x) - 1):
        if (y[i] > 0) != (y[i + 1] > 0):
            return float(np.exp(x[i] - y[i] * (x[i + 1] - x[i]) / (y[i + 1] - y[i])))
    i = 0 if abs(y[0]) < abs(y[-1]) else len(x) - 2
    slope = (y[i + 1] - y[i]) / (x[i + 1] - x[i])
    if abs(slope) < 0.1:
        return None
    edge = i if i == 0 else i + 1
    return float(np.exp(x[edge] - y[edge] / slope))
