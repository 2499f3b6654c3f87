"""Pages of the results of a design: their names, and the line that shows and switches them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
BEFORE: Final = "‹"  # stands for the pages before those named
AFTER: Final = "›"


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

    def cells(self) -> list[tuple[str, str]]:
        """Return name and shown title of each page, or of as many around the page shown as there is room for."""
        room = self.content_size.width or 1000
        padded = [(name, f" {title} ") for name, title in self.pages.items()]
        if _columns(padded) <= room:
            return padded
        names = list(self.pages)
        bare = list(self.pages.items())
        first = last = names.index(self.page)
        while (wider := _next_range(first, last, len(names))) and _columns(_part(bare, *wider)) <= room:
            first, last = wider
        return _part(bare, first, last)

    def on_resize(self) -> None:
        self.show(self.page, self.status)

    def show(self, page: str, status: str = "") -> None:
        """Mark the page that is shown."""
        self.page, self.status = page, status
        text = Text(no_wrap=True, overflow="ellipsis")
        for name, title in self.cells():
            text.append(title, "bold reverse" if name == page else "")
            text.append(" " * (GAP - 1))
        if text.cell_len + len(KEYS) <= (self.content_size.width or 1000):
            text.append(KEYS, "dim")
        text.append(status, "dim italic")
        self.update(text, layout=False)

    def on_click(self, event: Click) -> None:
        start = 0
        for name, title in self.cells():
            end = start + len(title) + GAP - 1
            if start <= event.x < end:
                self.post_message(self.Chosen(name))
            start = end


def _columns(cells: Sequence[tuple[str, str]]) -> int:
    """Return the columns of titles with the gaps between them."""
    return sum(len(title) + GAP - 1 for _, title in cells)


def _next_range(first: int, last: int, count: int) -> tuple[int, int] | None:
    """Return a range with one page more, behind it while there is one; None if all are in it."""
    if last + 1 < count:
        return first, last + 1
    return (first - 1, last) if first else None


def _part(cells: Sequence[tuple[str, str]], first: int, last: int) -> list[tuple[str, str]]:
    """Return the cells of a range, with a mark that leads to the next page on each side where there is one."""
    before = [(cells[first - 1][0], BEFORE)] if first else []
    after = [(cells[last + 1][0], AFTER)] if last + 1 < len(cells) else []
    return [*before, *cells[first : last + 1], *after]
