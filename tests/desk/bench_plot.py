"""What six plots of two lines cost the screen's loop, ours and textual-plot's: `python -m tests.desk.bench_plot`.

Both draw the same lines of 2,000 points at 160x48; the time is from the new data to the drawn screen.
"""

from __future__ import annotations

import asyncio
import statistics
import time

import numpy as np
from textual.app import App, ComposeResult
from textual.containers import Grid
from textual.widget import Widget
from textual_plot import HiResMode, PlotWidget

from railui.desk.widgets.axis import Axis
from railui.desk.widgets.picture import Line, Picture
from railui.desk.widgets.plot import Plot

POINTS, PLOTS, ROUNDS = 2000, 6, 15
X = np.linspace(0.0, 10.0, POINTS)


def lines(round_: int) -> list[np.ndarray]:
    """Two lines that differ from round to round."""
    return [np.sin((5 + k) * X + round_) + 0.2 * np.sin(97 * X) for k in range(2)]


def ours(plot: Widget, ys: list[np.ndarray]) -> None:
    assert isinstance(plot, Plot)
    plot.show(Picture(Axis("t", "s"), Axis("y", "mm"), [Line(X, y, f"{i}", "now") for i, y in enumerate(ys)]))


def theirs(plot: Widget, ys: list[np.ndarray]) -> None:
    assert isinstance(plot, PlotWidget)
    plot.clear()
    for y in ys:
        plot.plot(X, y, line_style="red", hires_mode=HiResMode.BRAILLE)


class Bench(App[None]):
    """Six plots and nothing else."""

    CSS = "Grid { grid-size: 3 2; } Plot { height: 1fr; width: 1fr; }"

    def __init__(self, own: bool) -> None:
        super().__init__()
        self.own = own

    def compose(self) -> ComposeResult:
        with Grid():
            for _ in range(PLOTS):
                yield Plot(Picture(Axis(""), Axis(""))) if self.own else PlotWidget()


async def timed(own: bool) -> float:
    """Median milliseconds from new data to the drawn screen."""
    app = Bench(own)
    async with app.run_test(size=(160, 48)) as pilot:
        plots = list(app.query(Plot if own else PlotWidget))
        found = []
        for round_ in range(ROUNDS):
            began = time.perf_counter()
            for plot in plots:
                (ours if own else theirs)(plot, lines(round_))
            app.screen._compositor.render_strips()
            found.append(1e3 * (time.perf_counter() - began))
            await pilot.pause()
        return statistics.median(found[3:])


if __name__ == "__main__":
    for name, own in (("railui.desk.widgets.plot", True), ("textual-plot", False), ("railui.desk.widgets.plot", True)):
        print(f"{name:18} {asyncio.run(timed(own)):6.1f} ms for {PLOTS} plots of two lines of {POINTS} points")
