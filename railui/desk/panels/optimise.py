"""Optimise panel: search plan, Pareto front, selection of a design."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal
from textual.message import Message

from railui.arrays import FloatArray
from railui.desk.messages import DesignOffered, JobDone, JobFailed, PartChanged, ProgressEvent
from railui.desk.panels.common import (
    COPY,
    PAUSE,
    START,
    STOP,
    VIEW,
)
from railui.desk.panels.plan_panel import PlanPanel
from railui.desk.panels.search_view import SearchView
from railui.desk.panels.shelf_page import ShelfPage
from railui.desk.presenters.search_history import GenerationSummary, SearchHistory
from railui.desk.presenters.search_plots import study_warnings
from railui.desk.services.jobs import BackgroundJob
from railui.desk.services.search_job import run_search
from railui.desk.state.plan import Plan
from railui.desk.state.run_conditions import RunConditions
from railui.desk.state.shelf import ShelfFullError
from railui.desk.widgets.dialogs import ProblemsDialog
from railui.desk.widgets.form_pane import FormPane
from railui.io.problems import FileProblems
from railui.vehicle.design_reader import Design


class OptimisePanel(PlanPanel):
    """Plan on the left; Pareto front, convergence and the selected design on the right."""

    BINDINGS: ClassVar[list[Any]] = [
        START,
        PAUSE,
        STOP,
        Binding("f", "front", "Front", tooltip="the front on half of the screen, or the plan"),
        VIEW,
        Binding("t", "take", "Take", tooltip="open the selected design in the form"),
        Binding("a", "add", "Variable", show=False, tooltip="add a variable"),
        Binding("g", "objective", "Objective", show=False, tooltip="add an objective"),
        Binding("delete", "remove", "Remove", show=False, tooltip="the entry under the cursor"),
        Binding("ctrl+z", "undo", "Undo", show=False),
        Binding("ctrl+y", "redo", "Redo", show=False),
        Binding("d", "design", "From form", show=False, tooltip="plan with the design in the form"),
        Binding("x", "axis(0)", "x axis", show=False, tooltip="put the column under the cursor on the x axis"),
        Binding("X", "axis(1)", "y axis", show=False, tooltip="put the column under the cursor on the y axis"),
        Binding("m", "keep", "Keep", show=False, tooltip="put the selected design on the shelf of the Design panel"),
        Binding("r", "range", "Range", show=False, tooltip="axes over all designs, or over the front"),
        COPY,
    ]
    HELP = """
## Optimise
The plan on the left begins with the design in the form (`d` updates it): variables with bounds, objectives,
constraints, track, speed and seeds. `a` adds a variable, `g` an objective, Delete removes the entry under the cursor,
Backspace restores its first value, `ctrl+z` and `ctrl+y` undo and redo.
`s` starts, `p` pauses, `k` stops the search; every evaluation is stored in the directory of the plan, so that `s` or
`railui optimise` resumes it. `f` shows the front on half of the screen, with a table of all objectives, variables and
constraints and their limits; ‹ and › mark values at a limit. Up and down select a design, left and right a column: `x`
and `X` put it on an axis of the front, `o` orders by it, `<` and `>` filter by it. `m` puts the design on the shelf,
space pins it: a letter marks it on the front, also when better ones replace it.
`r` shows all feasible designs or the front alone. The cross
shows mean and standard deviation of the objectives on new seeds that the search did not use. `v` shows ride quality,
spectra and convergence. `t` opens the design in the form, `f` returns to the plan.
"""

    class DesignRequested(Message):
        """Request for the design in the form."""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.history: SearchHistory | None = None

    @property
    def generations(self) -> list[GenerationSummary]:
        """Generations so far."""
        return self.history.generations if self.history else []

    @property
    def result(self) -> dict[str, Any] | None:
        """Result of the search, or None before its end."""
        return self.history.result if self.history else None

    def front(self) -> tuple[FloatArray, FloatArray]:
        """Return designs [n, variable] and objectives [n, objective] of the Pareto front."""
        return self.history.front() if self.history else (np.zeros((0, 0)), np.zeros((0, 2)))

    def compose(self) -> ComposeResult:
        with Horizontal():
            yield FormPane("Plan", "a variable · g objective · del remove", id="plan")
            yield SearchView(id="search")

    def on_mount(self) -> None:
        self.show_status()

    @property
    def search_view(self) -> SearchView:
        """Status, front and selected design."""
        return self.query_one(SearchView)

    def suggest_plan(self, design: Design, conditions: RunConditions) -> None:
        """Show a default plan for the design in the form unless the plan was edited or a search was started."""
        if self.is_edited or self.generations or self.job is not None:
            return
        if self.plan is None or self.plan.design is not design:
            self.begin_plan(Plan.for_design(design, conditions.track, conditions.speed))

    def action_design(self) -> None:
        """Use the current design of the form."""
        self.post_message(self.DesignRequested())

    def restore(self, plan: Plan, history: SearchHistory | None) -> None:
        """Show a plan and a search of an ended session."""
        self.begin_plan(plan)
        self.is_edited = True
        if history is not None:
            self.history = history
            self.search_view.show_history(history)
            is_finished = history.result is not None
            self.search_view.set_activity("restored" if is_finished else "restored: s resumes the search")
        self.show_status()
        self.post_message(PartChanged("plan"))

    # the search

    def action_start(self) -> None:
        if self.plan is None:
            self.notify("open a design first: ctrl+o")
            return
        if self.job is not None:
            self.notify("the search is running: k stops it")
            return
        self.search_view.failure = ""
        try:
            study = self.plan.write_study()
        except FileProblems as error:
            self.app.push_screen(ProblemsDialog("the plan", error))
            return
        except (OSError, RuntimeError, ValueError) as error:  # the directory is not writable or not a path
            text = self.search_view.failure = f"{error}: change the directory of the plan"
            self.search_view.set_activity(text)
            self.notify(text, severity="error", timeout=12)
            self.show_status()
            return
        self.history = SearchHistory(self.plan)
        self.history.study_warnings = study_warnings(study.warnings)
        directory = Path(self.plan.directory).expanduser()
        self.job = BackgroundJob(self, "search", lambda job: run_search(job, study, directory))
        self.search_view.show_history(self.history)
        self.show_status()

    @on(ProgressEvent)
    def _on_generation(self, message: ProgressEvent) -> None:
        generation: GenerationSummary | None = message.event
        if generation is not None and self.history is not None:
            self.search_view.set_activity(generation.activity)
            if self.history.add(generation):
                self.search_view.show_generation()
                self.post_message(PartChanged("search"))
        self.show_status()

    @on(JobDone)
    def _on_done(self, message: JobDone) -> None:
        assert self.history is not None
        result = message.result
        self.job = None
        self.history.result = result
        self.post_message(PartChanged("search"))
        self.search_view.set_activity(f"finished: {len(result['pareto'])} designs on the front")
        self.search_view.show_all()
        self.show_status()
        if result["knee"] is not None:
            self.search_view.designs.select(result["knee"])

    @on(JobFailed)
    def _on_failed(self, message: JobFailed) -> None:
        self.job = None
        self.search_view.failure = "" if message.is_stopped else message.text
        self.search_view.set_activity("stopped: s resumes the search" if message.is_stopped else message.text)
        self.search_view.show_all()
        self.show_status()
        if not message.is_stopped:
            self.notify(message.text, severity="error", timeout=10)

    def show_status(self) -> None:
        """Show the vehicle of the plan and the state of the search."""
        self.search_view.show_status(self.plan, self.job)
        self.update_commands()

    # the selected design

    def action_front(self) -> None:
        self._show_page(not self.search_view.is_front_page)

    def _show_page(self, is_front_page: bool) -> None:
        self.view = 0
        self.pane.display = not is_front_page
        self.search_view.show_page(is_front_page)
        if not is_front_page:
            self.pane.form.focus()
        self.update_commands()

    def action_axis(self, number: int) -> None:
        self.search_view.set_axis(number)

    def action_range(self) -> None:
        self.search_view.toggle_range()

    def can_start(self) -> bool:
        return self.plan is not None

    def command_state(self) -> object:
        view = self.search_view
        return super().command_state(), view.is_front_page, bool(view.columns), bool(view.designs.row_count)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "take":
            return bool(self.search_view.designs.row_count)
        if action in ("axis", "range"):
            return bool(self.search_view.is_front_page and self.search_view.columns)
        if action in ("add", "objective", "remove", "design"):
            return self.plan is not None and not self.search_view.is_front_page
        return super().check_action(action, parameters)

    def action_take(self) -> None:
        index = self.search_view.designs.index
        values = self.history.design_values(index) if self.history else None
        if self.history is None or values is None:
            self.notify("no design yet: s starts the search")
            return
        nominal = self.history.plan.design
        description = f"design {index} of the front"
        design = replace(nominal.with_values(values), name=f"{nominal.name}, {description}")
        home = nominal.source.parent if nominal.source is not None else Path()
        new_path = home / f"{self.history.plan.file_stem}_front_{index}.yaml"
        self.post_message(DesignOffered(description, design, nominal, new_path))

    def action_keep(self) -> None:
        """Put the selected design on the shelf."""
        index = self.search_view.designs.index
        values = self.history.design_values(index) if self.history else None
        if self.history is None or values is None:
            return
        description = f"design {index} of the front"
        design = self.history.plan.design.with_values(values)
        try:
            item = self.app.query_one(ShelfPage).put(design, note=description, origin=self.history.plan.file_stem)
        except ShelfFullError as error:
            self.notify(str(error), severity="warning")
            return
        self.notify(f"{description} is {item.letter} on the shelf of the Design panel", timeout=3)

    def action_copy(self) -> None:
        self.search_view.designs.action_copy()

    def arrange_parts(self) -> None:
        """Show as many parts as fit."""
        self.search_view.view = self.view
        self.search_view.arrange_parts()
