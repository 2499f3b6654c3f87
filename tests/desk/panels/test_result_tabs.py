"""Line of the pages: where not all names fit, a mark leads to those that are not named."""

from __future__ import annotations

import pytest
from textual.app import App, ComposeResult

from railui.desk.panels.result_pages import AFTER, BEFORE, GAP, PAGES, ResultTabs

pytestmark = pytest.mark.asyncio


class Tabs(App[None]):
    """The line alone."""

    def __init__(self) -> None:
        super().__init__()
        self.chosen: list[str] = []

    def compose(self) -> ComposeResult:
        yield ResultTabs(id="tabs")

    def on_result_tabs_chosen(self, event: ResultTabs.Chosen) -> None:
        self.chosen.append(event.page)


@pytest.mark.parametrize("columns", [18, 24, 34, 46, 100])
async def test_every_page_is_reached_by_mouse_at_any_width(columns: int) -> None:
    app = Tabs()
    names = list(PAGES)
    async with app.run_test(size=(columns, 3)) as pilot:
        tabs = app.query_one(ResultTabs)
        for page in names:
            tabs.show(page)
            cells = tabs.cells()
            titles = [title.strip() for _, title in cells]
            assert PAGES[page] in titles
            assert set(titles) <= {*PAGES.values(), BEFORE, AFTER}
            start = 0
            for name, title in cells:
                app.chosen.clear()
                await pilot.click(ResultTabs, offset=(start, 0))
                assert app.chosen == [name]
                start += len(title) + GAP - 1
            assert start <= columns


async def test_the_marks_lead_to_the_neighbours() -> None:
    app = Tabs()
    async with app.run_test(size=(20, 3)):
        tabs = app.query_one(ResultTabs)
        tabs.show("map")
        assert tabs.cells() == [("speed", BEFORE), ("map", "Map"), ("vehicle", "Vehicle"), ("shelf", AFTER)]
