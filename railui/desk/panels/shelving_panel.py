"""Panel with a design in work and the shelf of designs."""

from __future__ import annotations

from textual import on

from railui.desk.panels.paged_panel import PagedPanel
from railui.desk.panels.shelf_page import ShelfPage
from railui.desk.state.draft import Draft
from railui.desk.state.shelf import ShelfFullError


class ShelvingPanel(PagedPanel):
    """Panel whose design can be put on the shelf and taken from it."""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.draft: Draft | None = None

    def update_design(self) -> None:
        """Show the design in the form and evaluate it."""
        raise NotImplementedError

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
            self.draft.take(event.item.design, event.base, f"design {event.item.letter} of the shelf")
            self.update_design()
            self.notify(f"design {event.item.letter} is in the form; ctrl+z returns to the one before", timeout=3)
