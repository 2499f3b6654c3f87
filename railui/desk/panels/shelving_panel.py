"""Panel with a design in work and the shelf of designs."""

from __future__ import annotations

from typing import Any, ClassVar

from textual import on
from textual.binding import Binding

from railui.desk.editing import edit_file, show_problems
from railui.desk.panels.paged_panel import PagedPanel
from railui.desk.panels.profile_changes import ProfileChanges
from railui.desk.panels.shelf_page import ShelfPage
from railui.desk.state.draft import Draft
from railui.desk.state.shelf import ShelfFullError
from railui.desk.widgets.form import Form
from railui.io.problems import FileProblems


class ShelvingPanel(PagedPanel):
    """Panel whose design can be put on the shelf and taken from it."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("e", "edit", "Edit file", show=False, tooltip="open the file in $EDITOR, at the line of the value"),
    ]

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.draft: Draft | None = None
        self.profile_changes = ProfileChanges(self)

    def update_design(self) -> None:
        """Show the design in the form and evaluate it."""
        raise NotImplementedError

    def action_edit(self) -> None:
        """Open the file of the design in the user's editor, at the line of the field under the cursor."""
        draft = self.draft
        if draft is None or draft.path is None:
            self.notify("this design has no file yet: ctrl+s saves it")
            return
        field = self.query_one(Form).field
        if edit_file(self.app, draft.path, 0 if field is None else draft.line_numbers.get(field.path, 0)):
            self._read_edited(draft)

    def _read_edited(self, draft: Draft) -> None:
        """Read the file after it was edited, if it has changed; undo returns to the design before."""
        if not draft.is_changed_on_disk or draft.path is None:
            return
        try:
            draft.read_again()
        except FileProblems as error:
            show_problems(self.app, draft.path, error, lambda: self._read_edited(draft))
            return
        self.profile_changes.cancel()
        self.update_design()

    def action_keep(self) -> None:
        """Put the design in the form on the shelf."""
        if self.draft is None:
            return
        page = self.query_one(ShelfPage)
        try:
            item = page.keep(self.draft, None if self.results is None else self.results[0])
        except ShelfFullError as error:
            self.notify(str(error), severity="warning")
            return
        self.notify(f"design {item.letter} is on the shelf: ] shows it", timeout=3)
        if self.page is page:
            page.show(self.results)

    @on(ShelfPage.Taken)
    def _on_taken(self, event: ShelfPage.Taken) -> None:
        """Edit a design of the shelf, compared with another; undo returns to the design before."""
        if self.draft is not None:
            self.profile_changes.cancel()
            self.draft.take(event.item.design, event.base, f"design {event.item.letter} of the shelf")
            self.update_design()
            self.notify(f"design {event.item.letter} is in the form; ctrl+z returns to the one before", timeout=3)
