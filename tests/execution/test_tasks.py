"""Identity of stored evaluations: all Python sources that may change their digits."""

from __future__ import annotations

import ast
from pathlib import Path

import railui
from railui.execution.tasks import HASHED_SOURCES

PACKAGE = Path(railui.__file__).parent


def imported_parts(file: Path) -> set[str]:
    """Return the parts of the package that a file imports at run time, such as "io" and "progress.py"."""
    tree = ast.parse(file.read_text("utf-8"))
    blocks = [n for n in ast.walk(tree) if isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING"]
    type_checking = {id(n) for block in blocks for n in ast.walk(block)}
    names = [
        f"{n.module}.{alias.name}"
        for n in ast.walk(tree)
        if isinstance(n, ast.ImportFrom) and id(n) not in type_checking and (n.module or "").startswith("railui")
        for alias in n.names
    ]
    parts = {name.split(".")[1] for name in names}
    return {part if (PACKAGE / part).is_dir() else f"{part}.py" for part in parts}


def test_hashed_sources_import_only_hashed_sources() -> None:
    roots = [PACKAGE / name for name in HASHED_SOURCES]
    assert all(root.exists() for root in roots)
    files = [path for root in roots for path in (root, *root.rglob("*.py")) if path.is_file()]
    assert len(files) > 100
    not_hashed = {
        str(file.relative_to(PACKAGE)): imported_parts(file) - {*HASHED_SOURCES, "_core.py"} for file in files
    }
    assert not any(not_hashed.values()), {file: parts for file, parts in not_hashed.items() if parts}
