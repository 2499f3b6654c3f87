"""Time to draw six plots of two lines with railui and with textual-plot: `python -m tests.desk.bench_plot`.

Both draw the same lines of 2,000 points at 160x48; the time is from the new data to the drawn screen.
"""

from __future__ import annotations

import asyncio
import statistics
import time
from typing import ClassVar

import numpy as np
from textual.app import App, ComposeResult
from textual.containers import Grid
from textual.widget import Widget
from textual_plot import HiResMode, PlotWidget

from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot import PLOT_CLASSES, Plot
from railui.desk.widgets.plot_data import Line, PlotData

POINTS, PLOTS, ROUNDS = 2000, 6, 15
X = np.linspace(0.0, 10.0, POINTS)


def line_values(round_: int) -> list[np.ndarray]:
    """Return two lines that differ from round to round."""
    return [np.sin((5 + k) * X + round_) + 0.2 * np.sin(97 * X) for k in range(2)]


def show_railui(plot: Widget, ys: list[np.ndarray]) -> None:
    assert isinstance(plot, Plot)
    plot.show(PlotData(Axis("t", "s"), Axis("y", "mm"), [Line(X, y, f"{i}", "current") for i, y in enumerate(ys)]))


def show_textual_plot(plot: Widget, ys: list[np.ndarray]) -> None:
    assert isinstance(plot, PlotWidget)
    plot.clear()
    for y in ys:
        plot.plot(X, y, line_style="red", hires_mode=HiResMode.BRAILLE)


class Bench(App[None]):
    """App with six plots."""

    COMPONENT_CLASSES: ClassVar[set[str]] = set(PLOT_CLASSES)
    CSS = "Grid { grid-size: 3 2; } Plot { height: 1fr; width: 1fr; }"

    def __init__(self, is_railui: bool) -> None:
        super().__init__()
        self.is_railui = is_railui

    def compose(self) -> ComposeResult:
        with Grid():
            for _ in range(PLOTS):
                yield Plot(PlotData(Axis(""), Axis(""))) if self.is_railui else PlotWidget()


async def median_time(is_railui: bool) -> float:
    """Return the median time [ms] from new data to the drawn screen."""
    app = Bench(is_railui)
    async with app.run_test(size=(160, 48)) as pilot:
        plots = list(app.query(Plot if is_railui else PlotWidget))
        times = []
        for round_ in range(ROUNDS):
            start = time.perf_counter()
            for plot in plots:
                (show_railui if is_railui else show_textual_plot)(plot, line_values(round_))
            app.screen._compositor.render_strips()
            times.append(1e3 * (time.perf_counter() - start))
            await pilot.pause()
        return statistics.median(times[3:])


if __name__ == "__main__":
    railui = ("railui.desk.widgets.plot", True)
    for name, is_railui in (railui, ("textual-plot", False), railui):
        print(
            f"{name:18} {asyncio.run(median_time(is_railui)):6.1f} ms for {PLOTS} plots of two lines of {POINTS} points"
        )
