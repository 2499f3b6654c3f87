"""Pages of the results of a design: their names, and the line that shows and switches them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from rich.text import Text
from textual.containers import Vertical
from textual.events import Click
from textual.message import Message
from textual.widgets import Static

from railui.desk.presenters.design_results import Comparison

PAGES: Final = {"overview": "Overview", "stability": "Stability", "speed": "Speed", "shelf": "Shelf"}
GAP: Final = 2  # columns between two names


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
    def _pad(self) -> str:
        """Blanks around a title: none where the titles would not fit with them."""
        needed = sum(len(title) + 1 + GAP for title in self.pages.values())
        return " " if self.content_size.width >= needed or not self.content_size.width else ""

    def on_resize(self) -> None:
        self.show(self.page, self.status)

    def show(self, page: str, status: str = "") -> None:
        """Mark the page that is shown."""
        self.page, self.status = page, status
        text = Text(no_wrap=True, overflow="ellipsis")
        pad = self._pad
        for name, title in self.pages.items():
            text.append(f"{pad}{title}{pad}", "bold reverse" if name == page else "")
            text.append(" " * (GAP - 1))
        text.append(" [ ] ", "dim")
        text.append(status, "dim italic")
        self.update(text, layout=False)

    def on_click(self, event: Click) -> None:
        start = 0
        for name, title in self.pages.items():
            end = start + len(title) + 2 * len(self._pad) + GAP - 1
            if start <= event.x < end:
                self.post_message(self.Chosen(name))
            start = end
