"""Design panel: form of a design and its results with those of a base."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.message import Message

from railui.desk.messages import DesignsEvaluated, JobFailed
from railui.desk.panels.common import COPY, VIEW, set_titles
from railui.desk.panels.design_help import DESIGN_HELP
from railui.desk.panels.profile_changes import ContactComputed
from railui.desk.panels.saving import DesignSaver
from railui.desk.panels.shelving_panel import ShelvingPanel
from railui.desk.presenters.choices import effect_choices, effect_of_choice
from railui.desk.presenters.design_form import SPEED_PATH, TRACK_PATH, design_rows
from railui.desk.presenters.design_results import DesignResults, excitation_of
from railui.desk.services.design_jobs import evaluate_curving, evaluate_designs
from railui.desk.services.jobs import LatestJobRunner
from railui.desk.state.draft import Draft
from railui.desk.state.form_rows import Field, typed_speed_unit, value_text
from railui.desk.state.run_conditions import RunConditions
from railui.desk.widgets.dialogs import ChoiceDialog
from railui.desk.widgets.form import Form
from railui.desk.widgets.form_pane import FormPane
from railui.io.problems import FileProblems
from railui.io.units import read_speed

CONDITION_PATHS = (TRACK_PATH, SPEED_PATH)


class DesignPanel(ShelvingPanel):
    """Form of the design on the left, its results on the right."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("ctrl+z", "undo", "Undo", show=False),
        Binding("ctrl+y", "redo", "Redo", show=False),
        VIEW,
        Binding("V", "view(-1)", "View back", show=False),
        Binding("b", "base", "Base", tooltip="make this design the base of the comparison"),
        Binding("B", "file_base", "File as base", show=False, tooltip="make the design of the file the base"),
        Binding("x", "swap", "A/B", tooltip="exchange the design and its base"),
        Binding("a", "add", "Effect", tooltip="add an effect of the catalogue"),
        Binding("delete", "remove", "Remove effect", show=False),
        Binding("right_square_bracket", "page(1)", "Page", tooltip="overview, stability, speed, map, ..."),
        Binding("left_square_bracket", "page(-1)", "Page back", show=False),
        Binding("m", "keep", "Keep", show=False, tooltip="put this design on the shelf, under the next letter"),
        Binding("l", "stability", "Stability", show=False),
        Binding("t", "track", "Edit track", show=False),
        COPY,
    ]
    HELP = DESIGN_HELP

    class Changed(Message):
        """The design or its run conditions have changed."""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.first_conditions = RunConditions()  # of the first design
        self.speed_unit = "m/s"  # in which the speed is shown
        self.result_runner = LatestJobRunner(self, "results")

    def compose(self) -> ComposeResult:
        with Horizontal():
            yield FormPane("Design", "←→ slide · type · ⌫ base · / find", id="design-form")
            with Vertical(id="results"):
                yield from self.compose_pages()

    @property
    def pane(self) -> FormPane:
        """Form of the design."""
        return self.query_one(FormPane)

    @property
    def conditions(self) -> RunConditions:
        """Track and speed of the design."""
        return self.draft.conditions if self.draft is not None else self.first_conditions

    def command_state(self) -> object:
        draft, field = self.draft, self.query_one(Form).field
        is_effect = field is not None and field.path.startswith("effects.")
        return draft is not None, draft is not None and draft.design != draft.base, is_effect

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action in ("base", "swap"):
            return self.draft is not None and self.draft.design != self.draft.base
        if action == "remove":
            field = self.query_one(Form).field
            return field is not None and field.path.startswith("effects.")
        if action in ("add", "file_base", "track", "undo", "redo", "copy", "keep", "edit"):
            return self.draft is not None
        return super().check_action(action, parameters)

    @on(Form.FieldSelected)
    def _on_field_selected(self) -> None:
        self.update_commands()

    # the design

    def open(self, draft: Draft) -> None:
        """Show another design."""
        self.draft = draft
        self.profile_changes.cancel()
        self.results = None
        self.update_design()
        self.query_one(Form).focus()

    def update_design(self) -> None:
        """Show the design in the form and evaluate it; the last plots stay until its results are there."""
        draft = self.draft
        if draft is None:
            return
        self.pane.fill(list(design_rows(draft, self.speed_unit)), draft.base.values)
        set_titles(self.pane, f"{draft.name}{' ●' if draft.is_modified else ''}")
        self.result_runner.submit(partial(evaluate_designs, draft.design, draft.base, self.conditions, self.results))
        self.post_message(self.Changed())
        self.update_commands()

    @on(Form.ValueRequested)
    def _on_value_requested(self, event: Form.ValueRequested) -> None:
        self._request(event.path, event.value, event.gesture)

    def _request(self, path: str, value: Any, gesture: str) -> None:
        """Set a value; first compute the contact on a thread if it depends on the value."""
        if self.draft is None or not self.profile_changes.request(self.draft.design, path, value, gesture):
            self.set(path, value, gesture)

    @on(ContactComputed)
    def _on_contact_computed(self, event: ContactComputed) -> None:
        if self.profile_changes.take(event):
            self.set(event.path, event.value, event.gesture)

    @on(Form.StepRequested)
    def _on_step_requested(self, event: Form.StepRequested) -> None:
        """Step from the value that the design has now, so that every key press counts."""
        field = next((row for row in self._fields() if row.path == event.path), None)
        if field is not None and field.value is not None:
            latest = self.profile_changes.latest(event.path)
            field = field if latest is None else replace(field, value=latest)
            self._request(event.path, field.stepped(event.by), event.gesture)

    def _fields(self) -> Iterator[Field]:
        if self.draft is not None:
            yield from (row for row in design_rows(self.draft, self.speed_unit) if isinstance(row, Field))

    @on(Form.ResetRequested)
    def _on_reset_requested(self, event: Form.ResetRequested) -> None:
        if self.draft is not None and event.path not in CONDITION_PATHS:
            if self.profile_changes.latest(event.path) is not None:
                self.profile_changes.cancel()
            self.draft.reset(event.path)
            self.update_design()

    def set(self, path: str, value: Any, gesture: str = "") -> bool:
        """Set a value of the design or of the run conditions; show the error and return False if it is rejected."""
        try:
            if path in CONDITION_PATHS:
                self._set_condition(path, value, gesture)
            elif self.draft is not None:
                self.draft.set(path, value, gesture)
        except FileProblems as error:
            problem = error.problems[0]
            self.pane.reject(", ".join(text for text in (problem.message, problem.remedy) if text))
            return False
        except ValueError as error:
            self.pane.reject(str(error))
            return False
        self.update_design()
        self.pane.accept()
        return True

    def _set_condition(self, path: str, value: Any, gesture: str) -> None:
        change = {"speed": read_speed(value)} if path == SPEED_PATH else {"track": value}
        if path == SPEED_PATH:
            self.speed_unit = typed_speed_unit(value) or self.speed_unit
        conditions = replace(self.conditions, **change)
        excitation_of(conditions)  # raises for an invalid track
        if self.draft is not None:
            self.draft.set_conditions(conditions, path.rpartition(".")[2], gesture)
        else:
            self.first_conditions = conditions

    # results

    @on(DesignsEvaluated)
    def _on_evaluated(self, event: DesignsEvaluated) -> None:
        if not event.is_addition or self._is_shown(event.current, event.base):
            self.results = (event.current, event.base)
        if self.results is not None and any(results.guiding_force is None for results in self.results):
            self.result_runner.submit(partial(evaluate_curving, self.results), unless_waiting=True)
        if self.results is None or self.results[0] is not event.current:
            return  # curving of a design before the one that is shown
        self.page.show(self.results)

    def _is_shown(self, *results: DesignResults) -> bool:
        """True if results are of the designs and run conditions whose results are shown."""
        shown = self.results or ()
        return [(r.design, r.conditions) for r in shown] == [(r.design, r.conditions) for r in results]

    @on(JobFailed)
    def _on_failed(self, event: JobFailed) -> None:
        set_titles(self.query_one("#quality"), sub="no new result")
        self.pane.reject(event.text.splitlines()[0])

    # actions

    def action_undo(self) -> None:
        self.profile_changes.cancel()
        description = self.draft.undo() if self.draft else None
        self.notify(f"undone: {description}" if description else "nothing to undo", timeout=2)
        self.update_design()

    def action_redo(self) -> None:
        self.profile_changes.cancel()
        description = self.draft.redo() if self.draft else None
        self.notify(f"redone: {description}" if description else "nothing to redo", timeout=2)
        self.update_design()

    def action_base(self) -> None:
        if self.draft is not None:
            self.draft.set_base()
            self.notify("base set to the current design", timeout=2)
            self.update_design()

    def action_file_base(self) -> None:
        """Make the design of the file the base."""
        if self.draft is not None and self.draft.file is not None:
            self.draft.set_base(self.draft.file)
            self.update_design()

    def action_swap(self) -> None:
        if self.draft is not None:
            self.profile_changes.cancel()
            self.draft.swap_with_base()
            self.update_design()

    def action_track(self) -> None:
        self.query_one(Form).select(TRACK_PATH)
        self.query_one(Form).action_type()

    def action_add(self) -> None:
        if self.draft is not None:
            self.app.push_screen(ChoiceDialog("Add an effect", effect_choices(self.draft.design)), self._add_effect)

    def _add_effect(self, choice: str | None) -> None:
        if choice is None or self.draft is None:
            return
        try:
            self.draft.add_effect(effect_of_choice(choice))
        except FileProblems as error:
            self.notify(error.problems[0].message, severity="error")
            return
        self.update_design()
        group = f"effects.{len(self.draft.design.effects) - 1}."
        first = next((p for p in self.draft.design.paths() if p.startswith(group)), None)
        if first is not None:
            self.query_one(Form).select(first)

    def action_remove(self) -> None:
        field = self.query_one(Form).field
        if field is not None and self.draft is not None and field.path.startswith("effects."):
            self.draft.remove_effect(int(field.path.split(".")[1]))
            self.update_design()

    def action_copy(self) -> None:
        """Copy the value under the cursor."""
        field = self.query_one(Form).field
        if field is not None:
            self.app.copy_to_clipboard(value_text(field))
            self.notify(f"copied {value_text(field)}", timeout=2)

    # saving

    def save(self, then: Callable[[], object] | None = None) -> None:
        """Save the design in its file, or ask for a file name; run an action once it is saved."""
        if self.draft is None:
            self.notify("no design in the form: t takes that of a verdict or of the front, w writes the report")
        else:
            DesignSaver(self.app, self.draft, self.update_design, then).save()

    def save_as(self) -> None:
        """Ask for a file name and save the design there."""
        if self.draft is not None:
            DesignSaver(self.app, self.draft, self.update_design).save_as()
