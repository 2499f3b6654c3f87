"""Editing of the plan of a search, with undo and redo."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from textual import on

from railui.desk.messages import PartChanged
from railui.desk.panels.common import JobPanel
from railui.desk.presenters.choices import variable_choices
from railui.desk.presenters.plan_form import plan_rows
from railui.desk.state.form_rows import Field, typed_speed_unit
from railui.desk.state.history import History
from railui.desk.state.plan import USUAL_SCENARIOS, Plan, first_value
from railui.desk.widgets.dialogs import ChoiceDialog
from railui.desk.widgets.form import Form
from railui.desk.widgets.form_pane import FormPane
from railui.vehicle.design_reader import Design


class PlanPanel(JobPanel):
    """Panel with the form of a plan."""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.plans: History[Plan] | None = None
        self.first_plan: Plan | None = None  # whose values Backspace restores
        self.is_edited = False
        self.speed_unit = "m/s"  # in which the speed is shown

    @property
    def plan(self) -> Plan | None:
        """Plan in the form."""
        return self.plans.current if self.plans is not None else None

    @property
    def pane(self) -> FormPane:
        """Form of the plan."""
        return self.query_one(FormPane)

    def open(self, path: Path) -> None:
        """Open the plan of a study file; raise FileProblems with every error."""
        self.begin_plan(Plan.read(path))
        self.is_edited = True

    def begin_plan(self, plan: Plan) -> None:
        """Show a plan without steps to undo."""
        self.plans = History(plan)
        self.first_plan = plan
        self._fill(plan)

    def set_plan(self, plan: Plan, description: str = "plan", gesture: str = "") -> None:
        """Show a plan in the form; undo returns to the one before."""
        if self.plans is None:
            self.begin_plan(plan)
            return
        if plan != self.plan:
            self.plans.push(plan, description, gesture)
        self._fill(plan)

    def _fill(self, plan: Plan) -> None:
        base: dict[str, float] = {}
        for path in plan.bounds:
            base |= {f"bounds.{path}.{end}": plan.design.value(path) for end in ("lowest", "highest")}
        self.pane.fill(list(plan_rows(plan, self.speed_unit)), base)
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
            rows = (row for row in plan_rows(self.plan, self.speed_unit) if isinstance(row, Field))
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
        if path == "speed":
            self.speed_unit = typed_speed_unit(value) or self.speed_unit
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
