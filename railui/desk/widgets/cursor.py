"""Cursor line of forms and lists: visible in every theme, in 16 colours and without colours."""

from __future__ import annotations

from typing import Final

from rich.style import Style

CURSOR_STYLE: Final = Style(reverse=True, bold=True)  # colours of the widget exchanged, which every terminal can


def cursor_mark(is_plain: bool) -> str:
    """Return the mark at the beginning of the cursor line, which stays if the widget does not have the focus."""
    return ">" if is_plain else "▸"
