"""The page of the code: every file of kernel and package with its first line, which says what it is."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from words import code, plain, table

ROOT = Path(__file__).parents[2]
INTRODUCTION = """# The code

One idea a file; its first line says which. A floor may use what stands above it: in the kernel in the order of `lib.rs`; in the
package core, files, track and contact, study and capture, engine, report, and on top the commands and the desk, which never see
each other. Tests hold both orders. Only `core.py` imports the kernel, only `rust_core/python` knows Python, only the desk knows Textual.
"""


def page() -> str:
    """Two trees, folder by folder."""
    kernel = [part for top in ("src", "python/src") for part in _folders(ROOT / "rust_core" / top, ".rs")]
    package = _folders(ROOT / "railui", ".py")
    return "".join([INTRODUCTION, *kernel, *package])


def _folders(top: Path, ending: str) -> Iterator[str]:
    folders = sorted({file.parent for file in top.rglob(f"*{ending}")})
    for folder in folders:
        told = [(file.name, first_line(file)) for file in sorted(folder.glob(f"*{ending}"))]
        rows = [(code(name), plain(line)) for name, line in told if line]
        if rows:
            yield f"\n## {folder.relative_to(ROOT).as_posix()}\n\n{table(('file', 'what it is'), rows)}"


def first_line(file: Path) -> str:
    """The first sentence or line of a file's own words; empty where it has none."""
    text = file.read_text("utf-8")
    if file.suffix == ".rs":
        found = re.match(r"//! ?(.*)", text)
        return found[1] if found else ""
    return (ast.get_docstring(ast.parse(text)) or "").partition("\n")[0]
