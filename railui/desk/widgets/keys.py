"""Key bindings of widgets that the footer does not show."""

from __future__ import annotations

from textual.binding import Binding


def hidden_bindings(*rows: tuple[str, str, str]) -> list[Binding]:
    """Return bindings from rows of key, action and description."""
    return [Binding(key, action, description, show=False) for key, action, description in rows]
