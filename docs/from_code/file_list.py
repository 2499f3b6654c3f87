"""Page of the list of files: every file of the kernel and of the package with its first line."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from markdown_text import code, plain, table

ROOT = Path(__file__).parents[2]
INTRODUCTION = """# List of files

Every file of the kernel and of the package with its first line. [The code](../code.md) explains the layers and the way of the data.
"""


def page() -> str:
    """Return the lists of kernel and package, folder by folder."""
    kernel = [part for top in ("src", "python/src") for part in _folders(ROOT / "rust_core" / top, ".rs")]
    package = _folders(ROOT / "railui", ".py")
    return "".join([INTRODUCTION, *kernel, *package])


def _folders(top: Path, ending: str) -> Iterator[str]:
    folders = sorted({file.parent for file in top.rglob(f"*{ending}")})
    for folder in folders:
        lines = [(file.name, first_line(file)) for file in sorted(folder.glob(f"*{ending}"))]
        rows = [(code(name), plain(line)) for name, line in lines if line]
        if rows:
            yield f"\n## {folder.relative_to(ROOT).as_posix()}\n\n{table(('file', 'content'), rows)}"


def first_line(file: Path) -> str:
    """Return the first line of a file's docstring or module comment; empty without one."""
    text = file.read_text("utf-8")
    if file.suffix == ".rs":
        match = re.match(r"//! ?(.*)", text)
        return match[1] if match else ""
    return (ast.get_docstring(ast.parse(text)) or "").partition("\n")[0]
