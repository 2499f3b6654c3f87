"""Plots of a finished loop: time series of data and models, force characteristics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from railui.campaign.comparison import cut_samples
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot_data import Difference, Line, PlotData
from railui.report.loop.figures import Window, units_of
from railui.report.loop.force_evaluation import SuspensionForce, force_word
from railui.report.numbers import display_scale

if TYPE_CHECKING:
    from railui.identification.result import LoopResult

MAX_FORCE_POINTS: Final = 4000
LABELS: Final = {"measured": "data", "before": "calibrated", "after": "with effect"}
LINE_ROLES: Final = {"measured": "base", "before": "other", "after": "current"}


@dataclass(frozen=True, eq=False)
class FinishedLoop:
    """Result of a loop with its report and the data of its plots."""

    result: LoopResult
    report: dict[str, Any]
    window: Window
    series: Mapping[str, Any]
    forces: list[SuspensionForce]


def series_plot(finished: FinishedLoop, channel: str) -> PlotData:
    """Plot a few seconds of one channel: data, calibrated model, model with the identified effect."""
    window, result = finished.window, finished.result
    segment = window.segment
    row = segment.channels.index(channel)
    shown = slice(window.begin, window.end)
    t = segment.columns["t"][cut_samples(result.dataset.campaign, segment) :][shown]
    factor, unit = display_scale(finished.series["measured"][row, shown], units_of(result, segment)[channel])
    lines = [
        Line(t, factor * finished.series[key][row, shown], LABELS[key], LINE_ROLES[key])
        for key in LABELS
        if key in finished.series
    ]
    data, model = lines[0], lines[-1]
    difference = Difference(t, model.y - data.y, unit, f"{model.label} - data") if len(lines) > 1 else None
    return PlotData(Axis("t", "s"), Axis(channel, unit), lines, difference=difference)


def force_plot(forces: SuspensionForce) -> PlotData:
    """Plot the force at the location of an effect against the motion there."""
    step = max(1, len(forces.motion) // MAX_FORCE_POINTS)
    x_factor, x_unit = display_scale(forces.motion, forces.motion_unit)
    y_factor, y_unit = display_scale(forces.after, forces.force_unit)
    x = x_factor * forces.motion[::step]
    lines = [
        Line(x, y_factor * force[::step], LABELS[key], LINE_ROLES[key], is_points=True)
        for key, force in (("before", forces.before), ("after", forces.after))
    ]
    return PlotData(Axis("z", x_unit), Axis(force_word(forces.force_unit), y_unit), lines)
