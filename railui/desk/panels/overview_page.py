"""Overview of the results of a design: ride quality and plots."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Grid
from textual.widgets import Static

from railui.desk.panels.common import Pane, arrange_grid, set_titles
from railui.desk.panels.result_pages import ResultPage
from railui.desk.presenters.design_plots import VIEWS, WINDOWS
from railui.desk.presenters.design_results import Comparison
from railui.desk.presenters.ride_quality import comparison_text
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.plot_data import PlotData

NO_PLOT = PlotData(Axis(""), Axis(""), placeholder="no design: ctrl+o opens one")
ROWS_WITH_STRIP = 13  # of a plot with a strip of differences


class OverviewPage(ResultPage):
    """Ride quality above, plots below."""

    def compose(self) -> ComposeResult:
        yield Pane("Ride quality", id="quality")
        with Grid(id="plots"):
            for i, name in enumerate(VIEWS):
                yield Plot(NO_PLOT, name, id=f"view{i}", window=WINDOWS.get(name, (0.0, 1.0)))

    def show(self, results: Comparison | None) -> None:
        """Show other results; the last plots stay until the new ones are drawn."""
        self.results = results
        if results is not None:
            self._show_quality()
            self._show_plots([(self.view + k) % len(VIEWS) for k in range(len(VIEWS))], results)

    def _show_quality(self) -> None:
        quality = self.query_one("#quality", Static)
        if self.results is not None:
            quality.update(comparison_text(*self.results, quality.size.width), layout=False)
            set_titles(quality, sub="")

    def _show_plots(self, order: list[int], results: Comparison) -> None:
        """Draw the plots, each visible one in a refresh of its own, so that no key waits for all of them."""
        if results is not self.results:
            return  # newer results are being drawn
        for k, i in enumerate(order):
            plot = self.query_one(f"#view{i}", Plot)
            plot.show(list(VIEWS.values())[i](*results))
            if plot.display:
                self.call_after_refresh(self._show_plots, order[k + 1 :], results)
                return

    def on_resize(self) -> None:
        self.arrange_parts()
        self.call_after_refresh(self._show_quality)

    def arrange_parts(self) -> None:
        """Show as many plots as fit."""
        plots = [self.query_one(f"#view{i}") for i in range(len(VIEWS))]
        arrange_grid(self.query_one("#plots", Grid), plots, self.view, min_rows=ROWS_WITH_STRIP)
