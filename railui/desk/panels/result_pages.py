"""Pages of the results of a design: their names, and the line that shows and switches them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from rich.text import Text
from textual import on
from textual.containers import Vertical
from textual.events import Click
from textual.message import Message
from textual.widgets import Static

from railui.desk.messages import JobFailed
from railui.desk.presenters.design_results import Comparison

PAGES: Final = {
    "overview": "Overview",
    "stability": "Stability",
    "speed": "Speed",
    "map": "Map",
    "vehicle": "Vehicle",
    "shelf": "Shelf",
}
GAP: Final = 2  # columns between two names
KEYS: Final = " [ ] "  # that change the page
SHORT: Final = 4  # letters of a name where there is little room


class ResultPage(Vertical):
    """Page that shows the results of a design and of its base."""

    class StatusChanged(Message):
        """Change of the computation in progress; text: its description."""

        def __init__(self, text: str) -> None:
            super().__init__()
            self.text = text

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id)
        self.view = 0
        self.results: Comparison | None = None

    def show(self, results: Comparison | None) -> None:
        """Show other results; nothing of earlier ones stays."""
        raise NotImplementedError

    def leave(self) -> None:
        """Stop computing, because another page is shown."""

    def arrange_parts(self) -> None:
        """Show as many parts as fit, from number `view` on."""
        raise NotImplementedError

    @on(JobFailed)
    def _on_failed(self, message: JobFailed) -> None:
        message.stop()
        if not message.is_stopped:
            self.set_status(message.text)

    def set_status(self, text: str) -> None:
        """Show what the page does in the line of the pages."""
        self.post_message(self.StatusChanged(text))


class ResultTabs(Static):
    """Names of the pages in one line, with what the page shown is computing."""

    @dataclass
    class Chosen(Message):
        """A page was clicked."""

        page: str

    def __init__(self, pages: Mapping[str, str] = PAGES, *, id: str) -> None:
        """Create the line; pages: title by name."""
        super().__init__(id=id, classes="page-tabs")
        self.pages = pages
        self.page = next(iter(pages))
        self.status = ""

    def on_mount(self) -> None:
        self.show(self.page)

    @property
    def _cells(self) -> list[tuple[str, str]]:
        """Name and shown title of each page: with blanks around it, bare, or short, as there is room."""
        room = self.content_size.width or 1000
        rows = []
        for pad, letters in ((" ", 100), ("", 100), ("", SHORT)):
            rows = [
                (name, f"{pad}{title if name == self.page else title[:letters]}{pad}")
                for name, title in self.pages.items()
            ]
            if sum(len(title) + GAP - 1 for _, title in rows) <= room:
                break
        return rows

    def on_resize(self) -> None:
        self.show(self.page, self.status)

    def show(self, page: str, status: str = "") -> None:
        """Mark the page that is shown."""
        self.page, self.status = page, status
        text = Text(no_wrap=True, overflow="ellipsis")
        for name, title in self._cells:
            text.append(title, "bold reverse" if name == page else "")
            text.append(" " * (GAP - 1))
        if text.cell_len + len(KEYS) <= (self.content_size.width or 1000):
            text.append(KEYS, "dim")
        text.append(status, "dim italic")
        self.update(text, layout=False)

    def on_click(self, event: Click) -> None:
        start = 0
        for name, title in self._cells:
            end = start + len(title) + GAP - 1
            if start <= event.x < end:
                self.post_message(self.Chosen(name))
            start = end
