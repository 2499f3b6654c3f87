"""What the panels share."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from textual.containers import Grid
from textual.content import Content
from textual.widget import Widget

WIDE, HIGH = 44, 11  # cells that a picture wants


def titled(widget: Widget, title: str | None = None, sub: str | None = None) -> None:
    """Another title, where it is another: a title draws all that stands inside again. Its brackets are text."""
    for border, text in (("border_title", title), ("border_subtitle", sub)):
        if text is not None and (getattr(widget, border) or "") != (content := Content(text)).markup:
            setattr(widget, border, content)


def in_turn(owner: Widget, jobs: Sequence[Callable[[], None]]) -> None:
    """Draws one after the other, each in a refresh of its own: so no key waits for all of them."""
    if jobs:
        jobs[0]()
        owner.call_after_refresh(in_turn, owner, jobs[1:])


def arranged(grid: Grid, parts: Sequence[Widget], first: int, most: int = 6) -> list[Widget]:
    """Shows as many parts of a grid as there is room for, from the chosen one on; returns those shown."""
    columns, rows = max(1, min(3, grid.size.width // WIDE)), max(1, min(3, grid.size.height // HIGH))
    count = min(len(parts), columns * rows, most)
    columns = min(columns, count)
    rows = -(-count // columns)
    order = [parts[(first + k) % len(parts)] for k in range(len(parts))]
    grid.styles.grid_size_columns, grid.styles.grid_size_rows = columns, rows
    for k, part in enumerate(order):
        part.display = k < count
    grid.sort_children(key=lambda part: order.index(part) if part in order else len(order))
    return order[:count]
