"""Shelf of designs A to Z: their results, the parameters in which they differ, and the difference of any two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.message import Message
from textual.widgets import Static

from railui.desk.messages import JobDone, PartChanged, ProgressEvent
from railui.desk.panels.common import Pane, set_titles
from railui.desk.panels.result_pages import ResultPage
from railui.desk.presenters.design_results import Comparison, DesignResults
from railui.desk.presenters.shelf_tables import difference_columns, shelf_columns
from railui.desk.services.design_jobs import evaluate_one_by_one
from railui.desk.services.jobs import NewestJob
from railui.desk.state.draft import Draft
from railui.desk.state.shelf import Shelf, ShelfItem
from railui.desk.widgets.dialogs import InputDialog, QuestionDialog
from railui.desk.widgets.table import Table
from railui.vehicle.design_reader import Design

NARROW_COLUMNS = 50  # width of the difference below which names are cut
NAMES, NARROW_NAMES = 40, 13
EMPTY = "m puts the design in the form on the shelf"


class ShelfTable(Table):
    """Table of the shelf with the commands for the design under the cursor."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("enter", "take", "Edit", tooltip="edit the design under the cursor in the form"),
        Binding("space", "reference", "Compare with", tooltip="compare the others with the design under the cursor"),
        Binding("n", "note", "Note", tooltip="write a note on the design under the cursor"),
        Binding("delete", "remove", "Remove", show=False, tooltip="take the design off the shelf"),
    ]
    HELP = """
**Shelf**: `m` in the Design panel puts the design in the form here, under the next letter. The table has the results of
all designs under the run conditions of the form, then the parameters in which they differ. Space makes the design under
the cursor the reference (`*`); the lower table is the difference of the design under the cursor from it. Enter opens
the design under the cursor in the form with the reference as base, so that all plots compare these two.
"""

    @dataclass
    class Wanted(Message):
        """Command for the design under the cursor."""

        command: str

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        return bool(self.row_count) if action in ("take", "reference", "note", "remove") else True

    def action_take(self) -> None:
        self.post_message(self.Wanted("take"))

    def action_reference(self) -> None:
        self.post_message(self.Wanted("reference"))

    def action_note(self) -> None:
        self.post_message(self.Wanted("note"))

    def action_remove(self) -> None:
        self.post_message(self.Wanted("remove"))


class ShelfPage(ResultPage):
    """Designs of the shelf above, the difference of two of them below."""

    @dataclass
    class Taken(Message):
        """A design of the shelf was chosen for the form, with a base."""

        item: ShelfItem
        base: Design

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id)
        self.shelf = Shelf()
        self.reference = ""
        self.evaluated: dict[str, DesignResults] = {}  # by letter
        self.job = NewestJob(self, "shelf", delay=0.05)

    def compose(self) -> ComposeResult:
        with Vertical():
            yield ShelfTable("Shelf", EMPTY, id="shelf-table")
            yield Table("Difference", "the difference of two designs of the shelf", id="shelf-difference")
            yield Pane("History", id="shelf-history")

    @property
    def table(self) -> ShelfTable:
        """Table of all designs."""
        return self.query_one(ShelfTable)

    @property
    def item(self) -> ShelfItem | None:
        """Design under the cursor."""
        items = self.shelf.items
        return items[self.table.index] if self.table.index < len(items) else None

    def keep(self, draft: Draft, results: DesignResults | None) -> ShelfItem:
        """Put the design in the form on the shelf; results: of the design evaluated last."""
        item = self.put(draft.design, origin=draft.name, history=draft.states.descriptions())
        if results is not None and results.design == item.design:
            self.evaluated[item.letter] = results
            self._draw()
        return item

    def put(self, design: Design, *, note: str = "", origin: str, history: Sequence[str] = ()) -> ShelfItem:
        """Put a design on the shelf; raise ShelfFullError if every letter is taken."""
        now = f"{datetime.now():%Y-%m-%d %H:%M}"
        item = self.shelf.keep(design, note=note, origin=origin, time=now, history=history)
        self.reference = self.reference or item.letter
        self._changed()
        return item

    def restore(self, items: Sequence[ShelfItem]) -> None:
        """Show the shelf of an ended session."""
        self.shelf = Shelf(list(items))
        self.reference = items[0].letter if items else ""
        self.evaluated.clear()
        self._changed()

    def show(self, results: Comparison | None) -> None:
        """Show the designs under the run conditions of the form; results that are not known are computed."""
        self.results = results
        self._draw()
        if results is None:
            return
        conditions = results[0].conditions
        self.evaluated = {key: each for key, each in self.evaluated.items() if each.conditions == conditions}
        missing = [item for item in self.shelf.items if item.letter not in self.evaluated]
        if missing:
            self.set_status(f"simulating {len(missing)}")
            self.job.request(lambda job: evaluate_one_by_one(job, missing, conditions))
        else:
            self.set_status("")

    def leave(self) -> None:
        self.job.cancel()
        self.set_status("")

    @on(ProgressEvent)
    def _on_evaluated(self, message: ProgressEvent) -> None:
        message.stop()
        letter, results = message.event
        item = self.shelf.item(letter)
        if item is not None and item.design == results.design:
            self.evaluated[letter] = results
            self._draw()

    @on(JobDone)
    def _on_done(self, message: JobDone) -> None:
        message.stop()
        self.set_status("")

    # commands

    @on(ShelfTable.Wanted)
    def _on_command(self, event: ShelfTable.Wanted) -> None:
        item = self.item
        if item is None:
            return
        if event.command == "take":
            reference = self.shelf.item(self.reference) or item
            self.post_message(self.Taken(item, reference.design))
        elif event.command == "reference":
            self.reference = item.letter
            self._draw()
        elif event.command == "note":
            self.app.push_screen(InputDialog(f"Note on {item.letter}", item.note), lambda note: self._note(item, note))
        else:
            answers = {"r": "remove it", "c": "cancel"}
            question = QuestionDialog(f"Take design {item.letter} {item.note} off the shelf?", answers)
            self.app.push_screen(question, lambda answer: self._remove(item) if answer == "r" else None)

    def _note(self, item: ShelfItem, note: str | None) -> None:
        if note is not None:
            self.shelf.set_note(item.letter, note)
            self._changed()

    def _remove(self, item: ShelfItem) -> None:
        self.shelf.remove(item.letter)
        self.evaluated.pop(item.letter, None)
        if self.reference == item.letter:
            self.reference = self.shelf.items[0].letter if self.shelf.items else ""
        self._changed()

    def _changed(self) -> None:
        self._draw()
        self.post_message(PartChanged("shelf"))

    # drawing

    @on(Table.RowSelected)
    def _on_row_selected(self, event: Table.RowSelected) -> None:
        event.stop()
        if event.table is self.table:
            self._draw_difference()

    def _draw(self) -> None:
        self.table.show(shelf_columns(self.shelf.items, self.evaluated, self.reference))
        count = len(self.shelf.items)
        set_titles(self.table, sub=f"{count} of 26 · enter edits · space compares · n note" if count else "")
        self.table.refresh_bindings()
        self._draw_difference()

    def _draw_difference(self) -> None:
        table, item, reference = self.query_one("#shelf-difference", Table), self.item, self.shelf.item(self.reference)
        history = self.query_one("#shelf-history", Static)
        if item is None or reference is None:
            table.show([])
            history.update("", layout=False)
            return
        name_columns = NARROW_NAMES if table.size.width < NARROW_COLUMNS else NAMES
        columns = difference_columns(item, reference, self.evaluated, name_columns)
        table.show(columns if item is not reference else [])
        table.placeholder = f"{item.letter} is the reference: move to another design"
        table.refresh()
        set_titles(table, f"{item.letter} compared with {reference.letter}")
        set_titles(history, f"History of {item.letter}")
        note = f"{item.note} · " if item.note else ""
        history.update(f"{note}{item.time}, {item.origin}: {' › '.join(item.history)}", layout=False)

    def arrange_parts(self) -> None:
        """Hide the history in a low terminal."""
        self.query_one("#shelf-history").display = self.size.height >= 24

    def on_resize(self) -> None:
        self.arrange_parts()
        self.call_after_refresh(self._draw)
