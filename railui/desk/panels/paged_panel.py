"""Panel whose results are shown on pages, one at a time."""

from __future__ import annotations

from textual import on
from textual.widgets import ContentSwitcher

from railui.desk.panels.common import Panel
from railui.desk.panels.result_pages import PAGES, ResultPage, ResultTabs
from railui.desk.presenters.design_results import Comparison


class PagedPanel(Panel):
    """Panel with pages of results; only the page that is shown computes."""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.results: Comparison | None = None

    @property
    def page(self) -> ResultPage:
        """Page of the results that is shown."""
        return self.query_one(f"#{self.query_one(ContentSwitcher).current}", ResultPage)

    def show_page(self, name: str) -> None:
        """Show a page of the results."""
        if name != self.page.id:
            self.screen.minimize()
            self.page.leave()
            self.query_one(ContentSwitcher).current = name
            self.view = self.page.view
            self.query_one(ResultTabs).show(name)
            self.page.arrange_parts()
        if self.results is not None:
            self.page.show(self.results)

    @on(ResultTabs.Chosen)
    def _on_page_chosen(self, event: ResultTabs.Chosen) -> None:
        self.show_page(event.page)

    @on(ResultPage.StatusChanged)
    def _on_status_changed(self, event: ResultPage.StatusChanged) -> None:
        self.query_one(ResultTabs).show(str(self.page.id), event.text)

    def arrange_parts(self) -> None:
        """Show as many parts of the page as fit."""
        self.page.view = self.view
        self.page.arrange_parts()

    def action_page(self, by: int) -> None:
        names = list(PAGES)
        self.show_page(names[(names.index(str(self.page.id)) + by) % len(names)])

    def action_stability(self) -> None:
        self.show_page("stability")
