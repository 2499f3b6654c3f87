"""View of a search: status, Pareto front, convergence, selected design."""

from __future__ import annotations

from functools import partial

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.containers import Grid, Vertical
from textual.message import Message
from textual.widgets import Static

from railui.desk.messages import DesignsEvaluated, JobFailed
from railui.desk.panels.common import Pane, arrange_grid, draw_in_turn, set_titles
from railui.desk.presenters.design_plots import comfort_spectrum, displacement_spectrum
from railui.desk.presenters.design_results import DesignResults, evaluate_design
from railui.desk.presenters.ride_quality import comparison_text
from railui.desk.presenters.search_history import SearchHistory
from railui.desk.presenters.search_plots import (
    convergence_plot,
    design_text,
    fresh_comparison,
    fresh_text,
    front_plot,
    front_rows,
    plan_text,
)
from railui.desk.services.jobs import BackgroundJob, LatestJobRunner
from railui.desk.state.plan import Plan
from railui.desk.state.run_conditions import RunConditions
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.plot_data import PlotData
from railui.vehicle.design_reader import Design

NO_PLOT = PlotData(Axis(""), Axis(""), placeholder="s starts the search")
NO_CONVERGENCE = PlotData(Axis(""), Axis(""), placeholder="after two generations")
PARTS = ("front", "designs", "search-quality", "search-displacement", "search-comfort", "convergence")
MIN_QUALITY_COLUMNS = 24


class SearchView(Vertical):
    """View of the history of a search.

    nominal: results of the nominal design, once a design of the front was selected; activity: line of the status;
    fresh_text: statistics of the selected design on new seeds.
    """

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.plan: Plan | None = None
        self.job: BackgroundJob | None = None
        self.history: SearchHistory | None = None
        self.nominal: DesignResults | None = None
        self.activity = ""
        self.fresh_text = ""
        self.view = 0
        self.result_runner = LatestJobRunner(self, "results")

    def compose(self) -> ComposeResult:
        yield Pane("Search", id="search-status")
        with Grid(id="search-parts"):
            yield Plot(NO_PLOT, "Pareto front", id="front")
            yield Bars("Designs on the front", "", id="designs", has_cursor=True)
            yield Plot(NO_PLOT, "Displacement spectrum", id="search-displacement")
            yield Plot(NO_PLOT, "Comfort spectrum", id="search-comfort")
            yield Pane("Selected design", id="search-quality")
            yield Plot(NO_PLOT, "Convergence", id="convergence")

    @property
    def designs(self) -> Bars:
        """Rows of the designs on the front."""
        return self.query_one("#designs", Bars)

    def show_history(self, history: SearchHistory) -> None:
        """Show another search."""
        self.history = history
        self.nominal = None
        self.set_activity("")
        self.show_all()

    def set_activity(self, activity: str) -> None:
        """Set the line of the status."""
        self.activity = activity
        self.fresh_text = ""

    # drawing

    def show_all(self) -> None:
        """Draw every part."""
        draw_in_turn(self, [self._show_front, self._show_convergence])

    def show_generation(self) -> None:
        """Draw the front and the convergence after another generation."""
        self._show_front()
        self._show_convergence()

    def show_status(self, plan: Plan | None, job: BackgroundJob | None) -> None:
        """Show the vehicle of the plan and the state of the search."""
        self.plan = plan
        self.job = job
        self._show_status()

    def _show_status(self) -> None:
        pane = self.query_one("#search-status", Static)
        plan = self.history.plan if self.history else self.plan
        if plan is None:
            pane.update(Text("No design: ctrl+o opens a design or a study.", "dim"), layout=False)
            return
        text = plan_text(plan)
        text.append(self.activity or "s starts the search", "" if self.activity else "dim")
        text.append(f"\n{self.fresh_text}")
        pane.update(text, layout=False)
        set_titles(pane, sub=self._job_text())

    def _job_text(self) -> str:
        job, completed = self.job, self.history.completed if self.history else 0.0
        if job is None:
            return ""
        if job.is_stopping:
            return "stopping after this generation"
        if job.is_paused:
            return "paused: p resumes"
        if not completed:
            return "starting"
        return f"{100 * completed:.0f} % · {job.elapsed * (1 - completed) / completed:.0f} s left"

    def _show_front(self) -> None:
        plot, bars, history = self.query_one("#front", Plot), self.query_one("#designs", Bars), self.history
        if history is None or not (history.generations or history.result):
            plot.show(NO_PLOT)
            bars.show([])
            return
        bars.show(front_rows(history))
        set_titles(bars, sub=", ".join(history.objective_names))
        plot.show(front_plot(history, bars.index))

    def _show_convergence(self) -> None:
        data = convergence_plot(self.history) if self.history else NO_CONVERGENCE
        self.query_one("#convergence", Plot).show(data)

    # the selected design

    @on(Bars.RowSelected)
    def _on_row_selected(self, event: Bars.RowSelected) -> None:
        self._show_front()
        history = self.history
        values = history.design_values(event.index) if history else None
        if history is None or values is None:
            return
        event.stop()
        self.activity = design_text(history, event.index)
        self.fresh_text = fresh_text(history, event.index)
        self._show_status()
        plan = history.plan
        conditions = RunConditions(f"{plan.track} seed={plan.seeds.split(',')[0].strip()}", plan.speed)
        self.result_runner.submit(partial(_evaluate_selected, plan.design, values, conditions, self.nominal))

    @on(DesignsEvaluated)
    def _on_evaluated(self, event: DesignsEvaluated) -> None:
        event.stop()
        self.nominal = event.base
        quality = self.query_one("#search-quality", Static)
        width = max(MIN_QUALITY_COLUMNS, quality.content_size.width)
        index = self.designs.index
        statistics = fresh_comparison(self.history, index, width) if self.history else ""
        text = Text(f"{statistics}\n\n" if statistics else "", no_wrap=True, overflow="ellipsis")
        text.append_text(comparison_text(event.current, event.base, quality.size.width))
        quality.update(text, layout=False)
        self.query_one("#search-displacement", Plot).show(displacement_spectrum(event.current, event.base))
        self.query_one("#search-comfort", Plot).show(comfort_spectrum(event.current, event.base))

    @on(JobFailed)
    def _on_failed(self, event: JobFailed) -> None:
        event.stop()
        self.notify(event.text, severity="warning")

    def focus_front(self) -> None:
        """Move to the designs on the front and select one."""
        bars = self.designs
        if not bars.display:
            self.view = PARTS.index("designs")
            self.arrange_parts()
        bars.focus()
        if bars.rows:
            bars.select(bars.index)

    def arrange_parts(self) -> None:
        """Show as many parts as fit."""
        arrange_grid(self.query_one("#search-parts", Grid), [self.query_one(f"#{name}") for name in PARTS], self.view)


def _evaluate_selected(
    design: Design, values: dict[str, float], conditions: RunConditions, nominal: DesignResults | None
) -> Message:
    """Evaluate a design of the front and the nominal design, whose results are used again if they are known."""
    is_known = nominal is not None and nominal.conditions == conditions
    base = nominal if nominal is not None and is_known else evaluate_design(design, conditions)
    return DesignsEvaluated(evaluate_design(design.with_values(values), conditions), base)
