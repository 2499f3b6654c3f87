"""Markdown tables and inline text."""

from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table; bars inside its cells are escaped."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(map(_cell, row))} |\n" for row in lines)


def _cell(value: object) -> str:
    return str(value).replace("|", "\\|").replace("\n", " ")


def code(text: object) -> str:
    """Return a text as inline code; empty for an empty text or None."""
    return f"`{text}`" if text not in (None, "") else ""


def symbol(text: str) -> str:
    """Return a symbol or formula as inline code, since * and _ are markup in Markdown."""
    return f"`{text}`" if text else ""


def plain(text: str) -> str:
    """Return a text with stars, underscores and angle brackets escaped."""
    return text.replace("*", "\\*").replace("_", "\\_").replace("<", "&lt;")
