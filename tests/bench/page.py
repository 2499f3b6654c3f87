"""Measured tables in a page of the documentation, below the line of their command."""

from __future__ import annotations

from pathlib import Path

MARK = "<!-- results: "


def write_after(page: Path, text: str) -> None:
    """Puts `text` in the place of everything below the page's mark; ValueError where it has none."""
    lines = page.read_text("utf-8").splitlines()
    at = next((i for i, line in enumerate(lines) if line.startswith(MARK)), None)
    if at is None:
        raise ValueError(f"{page} has no line that begins with {MARK}")
    page.write_text("\n".join([*lines[: at + 1], "", text]), "utf-8")
