"""View of a loop: errors and parameters on the left, candidates, plots and data checks on the right."""

from __future__ import annotations

from typing import Final

from textual.app import ComposeResult
from textual.containers import Grid, Horizontal, Vertical, VerticalScroll
from textual.widgets import Static

from railui.desk.panels.common import draw_in_turn, set_titles
from railui.desk.presenters.loop_history import ERRORS, PARAMETERS, RANKING, LoopHistory
from railui.desk.presenters.loop_plots import force_plot, series_plot
from railui.desk.presenters.loop_rows import error_caption, error_rows, parameter_rows, ranking_caption, ranking_rows
from railui.desk.presenters.loop_text import details_text, details_title
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.plot_data import PlotData
from railui.report.loop.figures import shown_channels

NO_PLOT = PlotData(Axis(""), Axis(""), placeholder="after the verdict")
MULTI_PLOT_ROWS: Final = 30  # height from which several parts are shown
ALL_PARTS_ROWS: Final = 38  # height from which all parts are shown
ERRORS_ROWS: Final = 11  # height of the errors if the parameters are shown below them
NARROW_COLUMNS: Final = 50  # width below which rows are abbreviated
PARTS: Final = ("ranking", "series", "force", "details")  # of the right side
VIEW_OF_PART: Final = {"ranking": 0, "series": 1, "details": 3, "parameters": 4}  # if only one part is shown


class LoopView(Horizontal):
    """View of the history of a loop."""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.history = LoopHistory()
        self.has_job = False
        self.view = VIEW_OF_PART["details"]
        self.channel = 0

    def compose(self) -> ComposeResult:
        with Vertical(id="loop-left"):
            yield Bars("NRMSE, validation runs", "s starts the loop", id="errors")
            yield Bars("Parameters and rho", "", id="parameters")
        with Grid(id="loop-right"):
            yield Bars("Parameters and rho", "", id="parameters-right")
            yield Bars("Candidate effects", "score test follows the calibration", id="ranking")
            yield Plot(NO_PLOT, "Data and model", id="series")
            yield Plot(NO_PLOT, "Force characteristic", id="force")
            with VerticalScroll(id="details", classes="pane"):
                yield Static(id="details-text")

    def on_mount(self) -> None:
        self.show_details()
        self.arrange_parts()

    def on_resize(self) -> None:
        self.call_after_refresh(self._show_rows)

    # drawing

    def _show_rows(self) -> None:
        """Draw the rows whose text depends on the width."""
        self._show_errors()
        self._show_parameters()
        self._show_ranking()

    def show(self, history: LoopHistory, has_job: bool, part: str | None = None) -> None:
        """Show a history, beginning with a part if there is room for one only."""
        self.history = history
        self.has_job = has_job
        if part is not None:
            self.view = VIEW_OF_PART[part]
        self.arrange_parts()
        draw_in_turn(self, [self.show_details, self._show_plots, self._show_rows])  # rows last: they depend on widths

    def show_part(self, part: str) -> None:
        """Show a part if there is room for one only."""
        self.view = VIEW_OF_PART[part]
        self.arrange_parts()

    def show_changed(self, changed: str) -> None:
        """Draw the part that an event of the loop has changed."""
        if changed == ERRORS:
            self._show_errors()
        elif changed == PARAMETERS:
            self._show_parameters()
        elif changed == RANKING:
            self._show_ranking()

    def show_channel(self, by: int) -> None:
        """Show another channel of the time series."""
        self.channel += by
        self._show_plots()

    def show_details(self) -> None:
        """Show the data checks and, after the loop, the identifiability of the parameters."""
        set_titles(self.query_one("#details"), details_title(self.history))
        if self.history.campaign is not None:
            self.query_one("#details-text", Static).update(details_text(self.history))

    def _show_errors(self) -> None:
        bars = self.query_one("#errors", Bars)
        rows = error_rows(self.history, self._is_narrow)
        set_titles(bars, sub=error_caption(self._is_narrow) if rows else "")
        bars.show(rows)

    def _show_parameters(self) -> None:
        rows = parameter_rows(self.history, self._is_narrow)
        for name in ("#parameters", "#parameters-right"):
            bars = self.query_one(name, Bars)
            if bars.display or not rows:
                bars.show(rows)

    def _show_ranking(self) -> None:
        ranking = self.query_one("#ranking", Bars)
        ranking.show(ranking_rows(self.history, ranking.size.width < NARROW_COLUMNS))
        set_titles(ranking, sub=ranking_caption(self.history))

    @property
    def _is_narrow(self) -> bool:
        return self.query_one("#errors").size.width < NARROW_COLUMNS

    def _show_plots(self) -> None:
        finished = self.history.finished
        series, force = self.query_one("#series", Plot), self.query_one("#force", Plot)
        if finished is None:
            series.show(NO_PLOT)
            force.show(NO_PLOT)
            return
        channels = shown_channels(finished.window.segment)
        channel = channels[self.channel % len(channels)]
        set_titles(series, f"{channel}: data and model")
        series.show(series_plot(finished, channel))
        if finished.forces:
            set_titles(force, finished.forces[0].title)
            force.show(force_plot(finished.forces[0]))
            return
        is_localised = finished.result.discrepancy is not None
        reason = "see the report: w writes it" if is_localised else "no suspension effect added"
        force.show(PlotData(Axis(""), Axis(""), placeholder=reason))

    # layout

    def arrange_parts(self) -> None:
        """Show one part of the right side in a low terminal, several in a high one."""
        grid = self.query_one("#loop-right", Grid)
        is_tall = grid.size.height >= MULTI_PLOT_ROWS
        self.query_one("#loop-left").display = self.has_job or bool(self.history.errors)
        self.query_one("#parameters").display = is_tall
        self.query_one("#errors").styles.height = ERRORS_ROWS if is_tall else "1fr"
        shown = self._shown_parts(grid.size.height)
        for name in (*PARTS, "parameters-right"):
            self.query_one(f"#{name}").display = name in shown
        grid.styles.grid_size_columns = 1
        grid.styles.grid_size_rows = len(shown)
        self._show_parameters()
        self._show_errors()

    def _shown_parts(self, height: int) -> list[str]:
        if height < MULTI_PLOT_ROWS:
            return [[*PARTS, "parameters-right"][self.view % (len(PARTS) + 1)]]
        if self.history.finished is None:
            return ["ranking", "details"] if self.has_job else ["details"]
        if height >= ALL_PARTS_ROWS:
            return list(PARTS)
        hidden = (self.view - VIEW_OF_PART["series"] - 1) % len(PARTS)
        return [name for name in PARTS if name != PARTS[hidden]]
