"""Limits of a drifting parameter: a value, or the value at which a criterion of the vehicle reaches its limit."""

from __future__ import annotations

from typing import Final

import numpy as np

from railui.fleet.fleet_file import Limit
from railui.optimisation.evaluation import evaluate_in_process
from railui.optimisation.response_map import case_of, evaluate_vehicles
from railui.vehicle.design import Design

RANGE: Final = (0.05, 4.0)  # of the present value, in which the parameter may drift
POINTS: Final = 40


def critical_value(design: Design, limit: Limit, present: float) -> float | None:
    """Value of the parameter nearest to the present one at which the criterion reaches its limit.

    Parameters
    ----------
    design
        The vehicle as it is otherwise.
    present
        Value of the parameter now.

    Returns
    -------
    float or None
        None where the criterion does not reach its limit between 0.05 and 4 times the present value; the present value
        where it has reached it already.
    """
    assert limit.criterion is not None
    values = present * np.geomspace(*RANGE, POINTS)
    case = case_of(design, [limit.parameter], None, None)
    rows = case.vehicle.rows(np.concatenate([[present], values])[:, None])
    table = evaluate_vehicles(case, rows, [limit.criterion], evaluate_in_process())
    found = np.where(table.distance_share[:, 0] < 1.0, np.nan, table.values[limit.criterion][:, 0])
    margin = (found - limit.value) * (1.0 if limit.is_lower else -1.0)
    if not margin[0] > 0.0:
        return present
    crossings = [
        value
        for x, y, low, high in zip(margin[1:], margin[2:], values, values[1:], strict=False)
        if (value := _crossing(x, y, low, high)) is not None
    ]
    return min(crossings, key=lambda value: abs(np.log(value / present)), default=None)


def _crossing(x: float, y: float, low: float, high: float) -> float | None:
    """Value between two others at which the margin changes its sign, by linear interpolation."""
    if not (np.isfinite(x) and np.isfinite(y)) or (x > 0.0) == (y > 0.0):
        return None
    return float(low + (high - low) * x / (x - y))
