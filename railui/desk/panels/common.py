"""What the panels share."""

from __future__ import annotations

from textual.widget import Widget


def titled(widget: Widget, title: str | None = None, sub: str | None = None) -> None:
    """Another title, where it is another: a title draws all that stands inside again."""
    if title is not None and widget.border_title != title:
        widget.border_title = title
    if sub is not None and (widget.border_subtitle or "") != sub:
        widget.border_subtitle = sub
