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
    JobPanel,
)
from railui.desk.panels.search_view import SearchView
from railui.desk.presenters.choices import variable_choices
from railui.desk.presenters.plan_form import plan_rows
from railui.desk.presenters.search_history import GenerationSummary, SearchHistory
from railui.desk.services.jobs import BackgroundJob
from railui.desk.services.search_job import run_search
from railui.desk.state.form_rows import Field
from railui.desk.state.history import History
from railui.desk.state.plan import USUAL_SCENARIOS, Plan, first_value
from railui.desk.state.run_conditions import RunConditions
from railui.desk.widgets.dialogs import ChoiceDialog, ProblemsDialog
from railui.desk.widgets.form import Form
from railui.desk.widgets.form_pane import FormPane
from railui.io.problems import FileProblems
from railui.vehicle.design_reader import Design


class OptimisePanel(JobPanel):
    """Plan on the left; Pareto front, convergence and the selected design on the right."""

    BINDINGS: ClassVar[list[Any]] = [
        START,
        PAUSE,
        STOP,
        Binding("f", "front", "Front"),
        VIEW,
        Binding("t", "take", "Take design"),
        Binding("a", "add", "Variable"),
        Binding("g", "objective", "Objective", show=False),
        Binding("delete", "remove", "Remove", show=False),
        Binding("ctrl+z", "undo", "Undo", show=False),
        Binding("ctrl+y", "redo", "Redo", show=False),
        Binding("d", "design", "From form", show=False),
        COPY,
    ]
    HELP = """
## Optimise
The plan on the left begins with the design in the form (`d` updates it): variables with bounds, objectives,
constraints, track, speed and seeds. `a` adds a variable, `g` an objective, Delete removes the entry under the cursor,
Backspace restores its first value, `ctrl+z` and `ctrl+y` undo and redo.
`s` starts, `p` pauses, `k` stops the search; every evaluation is stored in the directory of the plan, so that `s` or
`railui optimise` resumes it. `f` moves to the front: up and down select a design, whose spectra are shown with the
baseline; the cross on the front shows mean and standard deviation of its objectives on new seeds that the search did
not use. `t` opens the design in the form.
"""

    class DesignRequested(Message):
        """Request for the design in the form."""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.plans: History[Plan] | None = None
        self.first_plan: Plan | None = None  # whose values Backspace restores
        self.is_edited = False
        self.history: SearchHistory | None = None

    @property
    def plan(self) -> Plan | None:
        """Plan in the form."""
        return self.plans.current if self.plans is not None else None

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
    def pane(self) -> FormPane:
        """Form of the plan."""
        return self.query_one(FormPane)

    @property
    def search_view(self) -> SearchView:
        """Status, front and selected design."""
        return self.query_one(SearchView)

    # the plan

    def suggest_plan(self, design: Design, conditions: RunConditions) -> None:
        """Show a default plan for the design in the form unless the plan was edited or a search was started."""
        if self.is_edited or self.generations or self.job is not None:
            return
        if self.plan is None or self.plan.design is not design:
            self._begin(Plan.for_design(design, conditions.track, conditions.speed))

    def open(self, path: Path) -> None:
        """Open the plan of a study file; raise FileProblems with every error."""
        self._begin(Plan.read(path))
        self.is_edited = True

    def _begin(self, plan: Plan) -> None:
        """Show a plan without steps to undo."""
        self.plans = History(plan)
        self.first_plan = plan
        self._fill(plan)

    def restore(self, plan: Plan, history: SearchHistory | None) -> None:
        """Show a plan and a search of an ended session."""
        self._begin(plan)
        self.is_edited = True
        if history is not None:
            self.history = history
            self.search_view.show_history(history)
            is_finished = history.result is not None
            self.search_view.set_activity("restored" if is_finished else "restored: s resumes the search")
        self.show_status()
        self.post_message(PartChanged("plan"))

    def set_plan(self, plan: Plan, description: str = "plan", gesture: str = "") -> None:
        """Show a plan in the form; undo returns to the one before."""
        if self.plans is None:
            self._begin(plan)
            return
        if plan != self.plan:
            self.plans.push(plan, description, gesture)
        self._fill(plan)

    def _fill(self, plan: Plan) -> None:
        base: dict[str, float] = {}
        for path in plan.bounds:
            base |= {f"bounds.{path}.{end}": plan.design.value(path) for end in ("lowest", "highest")}
        self.pane.fill(list(plan_rows(plan)), base)
        self.show_status()
        self.post_message(PartChanged("plan"))

    def use_design(self, design: Design) -> None:
        """Plan with another design; variables that it does not have are dropped."""
        if self.plan is not None:
            bounds = {p: b for p, b in self.plan.bounds.items() if p in design.paths()}
            plan = replace(self.plan, design=design, bounds=bounds, study=None, scenarios=USUAL_SCENARIOS)
            self.set_plan(plan, "design of the plan")

    @on(Form.StepRequested)
    def _on_step_requested(self, event: Form.StepRequested) -> None:
        """Step from the value that the plan has now, so that every key press counts."""
        if self.plan is not None:
            rows = (row for row in plan_rows(self.plan) if isinstance(row, Field))
            field = next((row for row in rows if row.path == event.path), None)
            if field is not None and (field.choices or field.is_number):
                self._set(event.path, field.stepped(event.by), event.gesture)

    @on(Form.ValueRequested)
    def _on_value_requested(self, event: Form.ValueRequested) -> None:
        self._set(event.path, event.value, event.gesture)

    def _set(self, path: str, value: Any, gesture: str = "") -> None:
        if self.plan is None:
            return
        self.is_edited = True
        try:
            self.set_plan(self.plan.with_value(path, value), _row_name(path), gesture)
        except ValueError as error:
            self.pane.reject(str(error))
        else:
            self.pane.accept()

    def action_undo(self) -> None:
        self._show_step(self.plans.undo() if self.plans is not None else None, "undo")

    def action_redo(self) -> None:
        self._show_step(self.plans.redo() if self.plans is not None else None, "redo")

    def _show_step(self, description: str | None, verb: str) -> None:
        self.notify(f"{verb}ne: {description}" if description else f"nothing to {verb}", timeout=2)
        if self.plan is not None:
            self._fill(self.plan)

    @on(Form.ResetRequested)
    def _on_reset_requested(self, event: Form.ResetRequested) -> None:
        """Restore the value of the plan as it was opened."""
        if self.plan is not None and self.first_plan is not None:
            value = first_value(self.plan, self.first_plan, event.path)
            if value is not None:
                self._set(event.path, value)

    def action_add(self) -> None:
        if self.plan is not None:
            choices = variable_choices(self.plan.design)
            self.app.push_screen(ChoiceDialog("Add a variable", choices), self._add_variable)

    def _add_variable(self, path: str | None) -> None:
        if path is not None and self.plan is not None:
            self.is_edited = True
            self.set_plan(self.plan.with_variable(path), f"added variable, {_row_name(path)}")
            self.pane.form.select(f"bounds.{path}.lowest")

    def action_objective(self) -> None:
        if self.plan is not None:
            self.is_edited = True
            self.set_plan(self.plan.with_objective(), "added objective")
            self.pane.form.select(f"objectives.{len(self.plan.objectives) - 1}.objective")

    def action_remove(self) -> None:
        field = self.pane.form.field
        if field is not None and self.plan is not None:
            self.is_edited = True
            self.set_plan(self.plan.without(field.path), f"removed {_row_name(field.path)}")

    def action_design(self) -> None:
        """Use the current design of the form."""
        self.post_message(self.DesignRequested())

    # the search

    def action_start(self) -> None:
        if self.plan is None:
            self.notify("open a design first: ctrl+o")
            return
        if self.job is not None:
            self.notify("the search is running: k stops it")
            return
        try:
            study = self.plan.write_study()
        except FileProblems as error:
            self.app.push_screen(ProblemsDialog("the plan", error))
            return
        except (OSError, RuntimeError, ValueError) as error:  # the directory is not writable or not a path
            text = f"{error}: change the directory of the plan"
            self.search_view.set_activity(text)
            self.notify(text, severity="error", timeout=12)
            self.show_status()
            return
        self.history = SearchHistory(self.plan)
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
        if result["warnings"]:
            self.notify("\n".join(result["warnings"]), title="Warnings", timeout=12)
        self.search_view.show_all()
        self.show_status()
        if result["knee"] is not None:
            self.search_view.designs.select(result["knee"])

    @on(JobFailed)
    def _on_failed(self, message: JobFailed) -> None:
        self.job = None
        self.search_view.set_activity("stopped: s resumes the search" if message.is_stopped else message.text)
        self.search_view.show_all()
        self.show_status()
        if not message.is_stopped:
            self.notify(message.text, severity="error", timeout=10)

    def show_status(self) -> None:
        """Show the vehicle of the plan and the state of the search."""
        self.search_view.show_status(self.plan, self.job)

    # the selected design

    def action_front(self) -> None:
        self.search_view.focus_front()

    def action_take(self) -> None:
        index = self.search_view.designs.index
        values = self.history.design_values(index) if self.history else None
        if self.history is None or values is None:
            self.notify("no design yet: s starts the search")
            return
        nominal = self.history.plan.design
        description = f"design {index + 1} of the front"
        design = replace(nominal.with_values(values), name=f"{nominal.name}, {description}")
        home = nominal.source.parent if nominal.source is not None else Path()
        new_path = home / f"{self.history.plan.file_stem}_front_{index + 1}.yaml"
        self.post_message(DesignOffered(description, design, nominal, new_path))

    def action_copy(self) -> None:
        self.search_view.designs.action_copy()

    def arrange_parts(self) -> None:
        """Show as many parts as fit."""
        self.search_view.view = self.view
        self.search_view.arrange_parts()


def _row_name(path: str) -> str:
    """Return the name of an entry of the plan.

    >>> _row_name("bounds.vehicle.primary.lateral_stiffness.lowest"), _row_name("objectives.0.over")
    ('lateral stiffness lowest', 'objective 1')
    """
    head, *rest = path.split(".")
    if head in ("objectives", "constraints"):
        number = f" {int(rest[0]) + 1}" if rest[0].isdecimal() else ""
        return f"{head[:-1]}{number}"
    return " ".join(path.split(".")[-2:] if head == "bounds" else path.split(".")[-1:]).replace("_", " ")
