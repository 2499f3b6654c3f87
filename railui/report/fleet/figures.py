"""Figures of a fleet: vehicles over quantities, and the history of the quantity behind an alarm."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.fleet.alarm import Alarm, mean_use
from railui.fleet.course import QUANTILE
from railui.fleet.observations import PARAMETER
from railui.fleet.schema import SECONDS_PER_DAY, are_dates
from railui.fleet.status import TypeState
from railui.report.figures.drawing import BLUE, GREY, ORANGE, Picture, draw_picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CELL: Final = (0.2, 0.14)  # inch, width and height of a cell of the map
LABELS: Final = (0.7, 0.055)  # inch for the names of the vehicles, and of a letter of the quantities
MAX_SCORE: Final = 6.0  # at which the colours end


def fleet_map(state: TypeState) -> Picture:
    """Draw the score of the largest CUSUM of every vehicle and quantity, over its threshold."""
    data = state.data
    names = [q.name for q in data.quantities]
    top = LABELS[1] * max(map(len, names)) + 0.2
    width = LABELS[0] + CELL[0] * len(names) + 0.5
    height = top + CELL[1] * len(data.vehicles) + 0.2

    def draw(ax: Axes) -> None:
        image = ax.imshow(state.monitor.largest_sums(), cmap="RdBu_r", aspect="auto", vmin=-1.0, vmax=1.0)
        ax.set_xticks(range(len(names)), names, rotation=90, fontsize=6)
        ax.set_yticks(range(len(data.vehicles)), data.vehicles, fontsize=5 if len(data.vehicles) > 30 else 7)
        ax.tick_params(length=0, labeltop=True, labelbottom=False, top=False, bottom=False)
        ax.grid(False)
        ax.set_position((LABELS[0] / width, 0.1 / height, CELL[0] * len(names) / width, 1.0 - (top + 0.1) / height))
        for alarm in state.alarms:
            ax.plot(alarm.crossing.quantities[0], alarm.crossing.subject, "o", ms=3.5, mfc="none", mec="black", mew=0.8)
        image.set_rasterized(False)

    alt = "largest sum of the sequential test over its threshold, vehicles by quantities; circles: alarms"
    return draw_picture(f"fleet_map_{state.type.name}", alt, (width, height), draw)


def history_picture(state: TypeState, alarm: Alarm) -> Picture:
    """Draw the blocks of the quantity behind an alarm, the band expected before the change, and its course."""
    data, monitor, v = state.data, state.monitor, alarm.crossing.subject
    j = alarm.index if alarm.index is not None else alarm.crossing.quantities[0]
    blocks = np.arange(len(monitor.start) - 1)
    levels = monitor.levels[min(alarm.reference.started + 1, alarm.reference.block)]
    quantity = data.quantities[j]
    scale = 100.0 if quantity.kind == PARAMETER else 1.0
    middle, is_date = 0.5 * (monitor.start[:-1] + monitor.start[1:]), are_dates(data.time)
    expected = scale * (levels.a[v, j] + levels.b[v, j] * mean_use(data, monitor, v, j, blocks))
    spread = scale * QUANTILE * np.nan_to_num(monitor.spread[:, v, j])
    value = scale * monitor.value[:, v, j]

    def draw(ax: Axes) -> None:
        x = _axis(middle, is_date)
        ax.fill_between(x, expected - spread, expected + spread, color="#cfe3f1", lw=0, label="expected, 90 %")
        ax.plot(x, value, ".", color=BLUE, ms=5, label="blocks")
        if alarm.course is not None:
            onset = alarm.course.onset
            ramp = expected + scale * alarm.course.rate * np.maximum(middle - onset, 0.0)
            shown = middle <= alarm.raised
            ax.plot(np.array(x)[shown], ramp[shown], color=ORANGE, lw=1.2, label="course")
            ends = _axis(np.array([alarm.course.onset_low, alarm.course.onset_high]), is_date)
            ax.axvspan(ends[0], ends[1], color="#f7d9c4", alpha=0.5, lw=0, label="onset, 90 %")
        ax.axvline(_axis(np.array([alarm.raised]), is_date)[0], color=GREY, lw=0.8, ls="--")
        ax.set_xlabel(_axis_label(is_date))
        ax.set_ylabel("% of nominal" if quantity.kind == PARAMETER else quantity.kind)
        ax.legend(fontsize=6, frameon=False, ncols=4, loc="upper left")
        ax.margins(y=0.25)

    alt = f"{quantity.name} of {alarm.vehicle}: blocks, expected band and course"
    return draw_picture(f"history_{alarm.vehicle}_{alarm.crossing.block}", alt, (7.2, 2.3), draw)


def section_picture(state: TypeState) -> Picture:
    """Draw the common error of the runs on each section over time."""
    data, monitor = state.data, state.monitor
    columns = [j for j, q in enumerate(data.quantities) if q.name.startswith("error at ")]
    middle, is_date = 0.5 * (monitor.start[:-1] + monitor.start[1:]), are_dates(data.time)
    colours = (BLUE, ORANGE, "#009e73", GREY, "#cc79a7", "#e69f00", "#56b4e9")

    def draw(ax: Axes) -> None:
        for s, name in enumerate(data.sections):
            common = monitor.cell_mean[:, s, columns]
            mean = np.array([np.nanmean(row) if np.any(np.isfinite(row)) else np.nan for row in common])
            ax.plot(_axis(middle, is_date), mean, "-", lw=1.1, color=colours[s % len(colours)], label=name or "all")
        ax.set_xlabel(_axis_label(is_date))
        ax.set_ylabel("log error, common [1]")
        ax.legend(fontsize=6, frameon=False, ncols=6)

    alt = "common deviation of the error of all vehicles on each section, block after block"
    return draw_picture(f"sections_{state.type.name}", alt, (7.2, 2.1), draw)


def _axis_label(is_date: bool) -> str:
    """Return the label of an axis of times."""
    return "date" if is_date else "time [days]"


def _axis(days: FloatArray, is_date: bool) -> list[Any]:
    """Return times [day] as dates, or as numbers of days."""
    if not is_date:
        return list(days.tolist())
    return [datetime.fromtimestamp(day * SECONDS_PER_DAY, UTC) for day in days.tolist()]
