"""Tables and words of Markdown."""

from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; bars inside its cells are escaped."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|").replace("\n", " ") for cell in row) + " |"
                     for row in lines) + "\n"  # fmt: skip


def code(text: object) -> str:
    """A word of the files, set as code; nothing where there is none."""
    return f"`{text}`" if text not in (None, "") else ""


def letters(text: str) -> str:
    """Letters and formulas of plain text as code, since * and _ mean something in Markdown."""
    return f"`{text}`" if text else ""


def plain(text: str) -> str:
    """Text whose stars and underscores are to be seen."""
    return text.replace("*", "\\*").replace("_", "\\_").replace("<", "&lt;")
