"""History of one quantity of one vehicle: block means, expected band, alarms and limit over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot_data import Band, LimitLine, Line, PlotData
from railui.fleet.block_means import BlockMeans
from railui.fleet.course import QUANTILE
from railui.fleet.schema import are_dates, read_time, time_text

NO_HISTORY: Final = PlotData(Axis(""), Axis(""), placeholder="no tested blocks yet")


def history_plot(means: BlockMeans, vehicle: int, quantity: int, alarms: Sequence[Mapping[str, Any]]) -> PlotData:
    """Return the plot of a quantity of a vehicle; alarms: all alarms of the fleet."""
    value, expected, sd = (x[:, vehicle, quantity] for x in (means.value, means.expected, means.sd))
    known = np.isfinite(value)
    if not known.any():
        return NO_HISTORY
    first, is_date = float(means.start[0]), are_dates(means.start)
    x = means.middle - first
    own = [row for row in alarms if row["vehicle"] == means.vehicles[vehicle]]
    predicted = np.isfinite(expected) & np.isfinite(sd)
    middle, spread = expected[predicted], QUANTILE * sd[predicted]
    name, unit = means.quantities[quantity], means.units[quantity]
    return PlotData(
        Axis(
            f"since {'' if is_date else 'day '}{time_text(first, is_date)}",
            "day",
            low=0.0,
            high=float(means.start[-1]) - first,
        ),
        Axis(name, "" if unit == "1" else unit),
        [Line(x[known], value[known], "blocks", "current", is_points=True)],
        [*_alarm_lines(own, name, first), *_limit_lines(own, name)],
        bands=[Band(x[predicted], middle - spread, middle + spread, "expected, 90 %", "base")],
    )


def _alarm_lines(own: Sequence[Mapping[str, Any]], name: str, first: float) -> list[LimitLine]:
    """Vertical lines at the alarms of the vehicle; those of this quantity have a label."""
    labels = ["alarm" if name in (row["quantity"], row["raised_by"]) else "" for row in own]
    return [LimitLine(read_time(row["raised"]) - first, label, True) for row, label in zip(own, labels, strict=True)]


def _limit_lines(own: Sequence[Mapping[str, Any]], name: str) -> list[LimitLine]:
    """Value of the quantity at its limit, of the latest alarm that has one."""
    limits = [row["limit"]["value"] for row in own if row["quantity"] == name and row["limit"] is not None]
    return [LimitLine(float(limits[-1]), "limit")] if limits and limits[-1] is not None else []
