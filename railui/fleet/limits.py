"""Limits of a drifting parameter: a value, or the value at which a criterion of the vehicle reaches its limit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.fleet.fleet_file import Limit
from railui.optimisation.evaluation import evaluate_in_process
from railui.optimisation.response_map import case_of, evaluate_vehicles
from railui.vehicle.design import Design

RANGE: Final = (0.05, 4.0)  # of the expected value, in which the parameter may drift
POINTS: Final = 40


@dataclass(frozen=True)
class Margin:
    """Values of a parameter at which a limit is reached, on both sides of the expected value.

    Attributes
    ----------
    low, high
        The nearest below and above it; infinite where there is none.
    is_exceeded
        Whether the expected value is beyond the limit.
    """

    low: float
    high: float
    is_exceeded: bool

    def value_towards(self, rate: float) -> float | None:
        """Return the value that a drift of a sign reaches; None where there is none."""
        value = self.high if rate > 0.0 else self.low
        return value if math.isfinite(value) else None


def margin_of_value(limit: Limit, expected: float) -> Margin:
    """Return the margin of a limit of the parameter itself."""
    if limit.is_lower:
        return Margin(limit.value, math.inf, expected < limit.value)
    return Margin(-math.inf, limit.value, expected > limit.value)


def margin_of_criterion(design: Design, limit: Limit, expected: float) -> Margin:
    """Return the margin of a limit of a criterion, searched from 0.05 to 4 times the expected value.

    Parameters
    ----------
    design
        The vehicle as it is otherwise.
    expected
        Value of the parameter without the change.
    """
    assert limit.criterion is not None
    values = expected * np.geomspace(*RANGE, POINTS)
    case = case_of(design, [limit.parameter], None, None)
    rows = case.vehicle.rows(np.concatenate([[expected], values])[:, None])
    table = evaluate_vehicles(case, rows, [limit.criterion], evaluate_in_process())
    found = np.where(table.distance_share[:, 0] < 1.0, np.nan, table.values[limit.criterion][:, 0])
    margin = (found - limit.value) * (1.0 if limit.is_lower else -1.0)
    # the expected value takes its place among the others, so that each crossing lies on one side of it
    place = int(np.searchsorted(np.abs(values), abs(expected)))
    at, margins = np.insert(values, place, expected), np.insert(margin[1:], place, margin[0])
    crossings = [
        value
        for x, y, first, second in zip(margins[:-1], margins[1:], at[:-1], at[1:], strict=True)
        if (value := _crossing(x, y, first, second)) is not None
    ]
    low = max((value for value in crossings if value <= expected), default=-math.inf)
    high = min((value for value in crossings if value > expected), default=math.inf)
    return Margin(low, high, not margin[0] > 0.0)


def _crossing(x: float, y: float, low: float, high: float) -> float | None:
    """Value between two others at which the margin changes its sign, by linear interpolation."""
    if not (np.isfinite(x) and np.isfinite(y)) or (x > 0.0) == (y > 0.0):
        return None
    return float(low + (high - low) * x / (x - y))
