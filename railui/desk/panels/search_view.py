"""View of a search: status, Pareto front, convergence, selected design."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any, ClassVar

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Grid, Vertical, VerticalScroll
from textual.message import Message
from textual.widgets import Static

from railui.desk.messages import DesignsEvaluated, JobFailed
from railui.desk.panels.common import Pane, draw_in_turn, set_titles
from railui.desk.panels.search_layout import PARTS, apply_layout, search_layout
from railui.desk.presenters.design_plots import comfort_spectrum, displacement_spectrum
from railui.desk.presenters.design_results import Comparison, DesignResults, evaluate_design
from railui.desk.presenters.front_columns import FrontColumn, front_columns, front_table
from railui.desk.presenters.front_plot import Pin, free_letter, front_plot, pin_marks
from railui.desk.presenters.parallel_plot import parallel_plot
from railui.desk.presenters.ride_quality import comparison_text
from railui.desk.presenters.search_history import SearchHistory
from railui.desk.presenters.search_plots import (
    baseline_comparison,
    convergence_plot,
    fresh_comparison,
    fresh_text,
    plan_text,
    warnings_text,
)
from railui.desk.services.jobs import BackgroundJob, LatestJobRunner
from railui.desk.state.plan import Plan
from railui.desk.state.run_conditions import RunConditions
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.plot_data import PlotData
from railui.desk.widgets.table import Table
from railui.track.excitation import is_track_file
from railui.vehicle.design_reader import Design

NO_PLOT = PlotData(Axis(""), Axis(""), placeholder="s starts the search")
NO_DESIGN = PlotData(Axis(""), Axis(""), placeholder="select a design")
NO_CONVERGENCE = PlotData(Axis(""), Axis(""), placeholder="after two generations")
MIN_QUALITY_COLUMNS = 24


class SearchView(Vertical):
    """View of the history of a search.

    nominal: results of the nominal design, once a design of the front was selected; activity: line of the status;
    fresh_text: statistics of the selected design on new seeds; axes: numbers of the quantities on the axes of the
    front; shows_all: its axes cover all designs.
    """

    BINDINGS: ClassVar[list[Any]] = [
        Binding("space", "pin", "Pin", show=False, tooltip="mark the selected design on the front, or no longer"),
    ]

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.plan: Plan | None = None
        self.job: BackgroundJob | None = None
        self.history: SearchHistory | None = None
        self.nominal: DesignResults | None = None
        self.activity = ""
        self.fresh_text = ""
        self.failure = ""  # with which the search ended
        self.view = 0
        self.is_front_page = False
        self.axes = (0, 1)
        self.shows_all = False
        self.columns: list[FrontColumn] = []
        self.selected: dict[str, float] | None = None  # variables of the design that was selected last
        self.results: Comparison | None = None  # its results and those of the nominal design
        self.pins: list[Pin] = []
        self._warnings: tuple[str, list[str], bool] | None = None  # shown, in one line on the page of the front
        self.result_runner = LatestJobRunner(self, "results")

    def compose(self) -> ComposeResult:
        yield Pane("Search", id="search-status")
        with VerticalScroll(id="search-warnings", classes="pane"):
            yield Static(id="search-warnings-text")
        with Grid(id="search-parts"):
            yield Plot(NO_PLOT, "Pareto front", id="front")
            yield Table("Designs on the front", "no design yet", id="designs")
            yield Plot(NO_PLOT, "Parallel co-ordinates", id="parallel")
            yield Plot(NO_PLOT, "Displacement spectrum", id="search-displacement")
            yield Plot(NO_PLOT, "Comfort spectrum", id="search-comfort")
            yield Pane("Selected design", id="search-quality")
            yield Plot(NO_PLOT, "Convergence", id="convergence")

    @property
    def designs(self) -> Table:
        """Designs on the front with all their quantities."""
        return self.query_one("#designs", Table)

    def show_history(self, history: SearchHistory) -> None:
        """Show another search."""
        self.history = history
        self.nominal, self.results, self.selected = None, None, None
        self.pins = []
        self.query_one("#search-quality", Static).update("", layout=False)
        for name in ("search-displacement", "search-comfort"):
            self.query_one(f"#{name}", Plot).show(NO_DESIGN)
        self.axes = (0, 1) if len(history.plan.objectives) > 1 else (len(history.plan.objectives), 0)
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

    def _show_warnings(self) -> None:
        """Show the failure of the search and all its warnings, or those of the plan before one; none take no room."""
        warnings = self.history.warnings if self.history else self.plan.warnings() if self.plan else []
        if (self.failure, warnings, self.is_front_page) == self._warnings:
            return
        self._warnings = self.failure, warnings, self.is_front_page
        box = self.query_one("#search-warnings")
        box.display = bool(self.failure or warnings)
        box.set_class(self.is_front_page, "one-line")
        count = "1 warning" if len(warnings) == 1 else f"{len(warnings)} warnings"
        set_titles(box, count, "tab: all of them")
        if self.failure:
            count = f"failed, {count}" if warnings else "failed"
            set_titles(box, count)
        head = f"{count}, tab shows all: " if self.is_front_page else ""
        text = Text(head, "yellow")
        text.append(f"{self.failure}\n" if self.failure else "", "bold red")
        text.append(warnings_text(warnings), "yellow")
        self.query_one("#search-warnings-text", Static).update(text)

    def _show_status(self) -> None:
        self._show_warnings()
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
        history = self.history
        self.columns = front_columns(history) if history is not None and (history.generations or history.result) else []
        table = self.designs
        table.show(front_table(history, self.columns) if history is not None and self.columns else [])
        self._find_selected()
        self._show_count()
        self._plot_front()

    def _show_count(self) -> None:
        table = self.designs
        shown, count = len(table.order), table.row_count
        text = f"{count} designs" if shown == count else f"{shown} of {count} designs, u all"
        set_titles(table, sub=f"{text} · o order · < > filter · x X axes" if count else "")

    @on(Table.Filtered)
    def _on_filtered(self, event: Table.Filtered) -> None:
        event.stop()
        self._show_count()
        self._plot_front()

    def _find_selected(self) -> None:
        """Keep the cursor on the selected design while the front changes, and say so if it is no longer on it."""
        if self.selected is None or self.history is None:
            return
        rows = self.history.front()[0].tolist()
        wanted = list(self.selected.values())
        if wanted in rows:
            self.designs.place(rows.index(wanted))
        is_on_front = wanted in rows
        set_titles(self.query_one("#search-quality"), "Selected design" + ("" if is_on_front else ", no longer on it"))

    def _plot_front(self) -> None:
        plot, history = self.query_one("#front", Plot), self.history
        if history is None or not self.columns:
            plot.show(NO_PLOT)
            self.query_one("#parallel", Plot).show(NO_PLOT)
            return
        self.query_one("#parallel", Plot).show(parallel_plot(self.columns, self.designs.order, self.designs.index))
        data = front_plot(history, self.columns, *self.axes, self.designs.index, self.shows_all)
        plot.show(replace(data, marks=[*data.marks, *pin_marks(self.pins, *self.axes)]))
        evaluations = history.generations[-1].evaluations if history.generations else 0
        count = f"{self.designs.row_count} of {evaluations} designs"
        set_titles(plot, sub=" · ".join(text for text in (count, self._job_text()) if text))

    def set_axis(self, number: int) -> None:
        """Show the table's column under the cursor on an axis of the front: 0 horizontal, 1 vertical."""
        column = self.designs.column - 1  # the first column is the number of the design
        if 0 <= column < len(self.columns):
            other = self.axes[1 - number]
            pair = (column, other) if number == 0 else (other, column)
            self.axes = (self.axes[1], self.axes[0]) if column == other else pair
            self._plot_front()

    def action_pin(self) -> None:
        """Pin the selected design, so that its place on the front stays marked, or take its pin off."""
        values = self.history.design_values(self.designs.index) if self.history else None
        if values is None:
            return
        known = next((pin for pin in self.pins if pin.variables == values), None)
        if known is not None:
            self.pins.remove(known)
        else:
            index = self.designs.index
            self.pins.append(Pin(free_letter(self.pins), values, [float(c.values[index]) for c in self.columns]))
        self._plot_front()

    def toggle_range(self) -> None:
        """Scale the axes of the front to all feasible designs, or to the front again."""
        self.shows_all = not self.shows_all
        self._plot_front()

    def _show_convergence(self) -> None:
        data = convergence_plot(self.history) if self.history else NO_CONVERGENCE
        self.query_one("#convergence", Plot).show(data)

    # the selected design

    @on(Table.RowSelected)
    def _on_row_selected(self, event: Table.RowSelected) -> None:
        self._plot_front()
        history = self.history
        values = history.design_values(event.index) if history else None
        if history is None or values is None:
            return
        event.stop()
        self.selected = values
        set_titles(self.query_one("#search-quality"), "Selected design")
        self.activity = f"design {event.index} of the front"
        self.fresh_text = fresh_text(history, event.index)
        self._show_status()
        plan = history.plan
        seed = "" if is_track_file(plan.track) else f" seed={plan.seeds.split(',')[0].strip()}"
        conditions = RunConditions(f"{plan.track}{seed}", plan.speed)
        self.result_runner.submit(partial(_evaluate_selected, plan.design, values, conditions, self.nominal))

    @on(DesignsEvaluated)
    def _on_evaluated(self, event: DesignsEvaluated) -> None:
        event.stop()
        self.nominal = event.base
        self.results = (event.current, event.base)
        self._show_quality()
        self.query_one("#search-displacement", Plot).show(displacement_spectrum(event.current, event.base))
        self.query_one("#search-comfort", Plot).show(comfort_spectrum(event.current, event.base))

    def _show_quality(self) -> None:
        """Show ride quality and statistics of the design that was selected last."""
        if self.results is None or self.history is None:
            return
        quality = self.query_one("#search-quality", Static)
        width = max(MIN_QUALITY_COLUMNS, quality.content_size.width)
        index = self.designs.index
        parts = [fresh_comparison(self.history, index, width), baseline_comparison(self.history, index, width)]
        statistics = "\n".join(part for part in parts if part)
        text = Text(f"{statistics}\n" if statistics else "", no_wrap=True, overflow="ellipsis")
        text.append_text(comparison_text(*self.results, quality.size.width))
        quality.update(text, layout=False)

    @on(JobFailed)
    def _on_failed(self, event: JobFailed) -> None:
        event.stop()
        self.notify(event.text, severity="warning")

    def show_page(self, is_front_page: bool) -> None:
        """Show the page of the front, with its table in focus, or the overview next to the plan."""
        self.is_front_page = is_front_page
        self.view = 0
        self._show_warnings()
        self.arrange_parts()
        if is_front_page:
            self.designs.focus()
            if self.designs.row_count:
                self.designs.select(self.designs.index)

    def on_resize(self) -> None:
        self.arrange_parts()

    def arrange_parts(self) -> None:
        """Arrange the parts in the room there is."""
        grid = self.query_one("#search-parts", Grid)
        self.query_one("#search-status").display = not self.is_front_page
        layout = search_layout(grid.size.width, grid.size.height, self.view, self.is_front_page)
        apply_layout(grid, {name: self.query_one(f"#{name}") for name in PARTS}, layout)
        self.call_after_refresh(self._show_quality)  # its columns depend on its width


def _evaluate_selected(
    design: Design, values: dict[str, float], conditions: RunConditions, nominal: DesignResults | None
) -> Message:
    """Evaluate a design of the front and the nominal design, whose results are used again if they are known."""
    is_known = nominal is not None and nominal.conditions == conditions
    base = nominal if nominal is not None and is_known else evaluate_design(design, conditions)
    return DesignsEvaluated(evaluate_design(design.with_values(values), conditions), base)
