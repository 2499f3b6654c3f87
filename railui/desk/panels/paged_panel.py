"""Panel whose results are shown on pages, one at a time."""

from __future__ import annotations

from typing import Any, ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.widgets import ContentSwitcher

from railui.api.map_rows import SPEED
from railui.desk.panels.common import Panel
from railui.desk.panels.map_page import MapPage
from railui.desk.panels.overview_page import OverviewPage
from railui.desk.panels.result_pages import PAGES, ResultPage, ResultTabs
from railui.desk.panels.shelf_page import ShelfPage
from railui.desk.panels.speed_page import SpeedPage
from railui.desk.panels.stability_page import StabilityPage
from railui.desk.panels.vehicle_page import VehiclePage
from railui.desk.presenters.design_form import SPEED_PATH
from railui.desk.presenters.design_results import Comparison


class PagedPanel(Panel):
    """Panel with pages of results; only the page that is shown computes."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("h", "axis('x')", "Axis", tooltip="parameter on the horizontal axis of the map"),
        Binding("H", "axis('y')", "Axis up", show=False, tooltip="parameter or speed on the vertical axis of the map"),
        Binding("p", "play", "Play", tooltip="play or pause the animation of the vehicle"),
    ]

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.results: Comparison | None = None

    def compose_pages(self) -> ComposeResult:
        """Create the line of the pages and the pages."""
        yield ResultTabs(id="result-tabs")
        with ContentSwitcher(initial="overview"):
            yield OverviewPage(id="overview")
            stability = StabilityPage(id="stability")
            yield stability
            yield SpeedPage(stability.known, id="speed")
            yield MapPage(id="map")
            yield VehiclePage(id="vehicle")
            yield ShelfPage(id="shelf")

    def set(self, path: str, value: Any, gesture: str = "") -> bool:
        """Set a value of the design or of the run conditions."""
        raise NotImplementedError

    @on(MapPage.ValuesChosen)
    def _on_values_chosen(self, event: MapPage.ValuesChosen) -> None:
        """Set the values under the cursor of a map in the form."""
        for path, value in event.values.items():
            self.set(SPEED_PATH if path == SPEED else path, value)

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
            self.refresh_bindings()
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

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "axis":
            return self.is_mounted and self.page.id == "map" and self.results is not None
        if action == "play":
            return self.is_mounted and self.page.id == "vehicle" and self.results is not None
        return super().check_action(action, parameters)

    def action_axis(self, name: str) -> None:
        """Choose the parameter of an axis of the map."""
        self.query_one(MapPage).ask_axis(name)

    def action_play(self) -> None:
        """Play or pause the animation of the vehicle."""
        self.query_one(VehiclePage).toggle()

    def action_stability(self) -> None:
        self.show_page("stability")
