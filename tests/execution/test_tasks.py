"""What a stored evaluation is known by: all the Python that decides its digits."""

from __future__ import annotations

import ast
from pathlib import Path

import railui
from railui.execution.tasks import COMPUTING

HOME = Path(railui.__file__).parent


def imported(file: Path) -> set[str]:
    """The parts of the package that a file takes something from while it runs: "files", "core.py"."""
    tree = ast.parse(file.read_text("utf-8"))
    typing = [n for n in ast.walk(tree) if isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING"]
    idle = {id(n) for one in typing for n in ast.walk(one)}
    names = [
        f"{n.module}.{alias.name}"
        for n in ast.walk(tree)
        if isinstance(n, ast.ImportFrom) and id(n) not in idle and (n.module or "").startswith("railui")
        for alias in n.names
    ]
    parts = {name.split(".")[1] for name in names}
    return {part if (HOME / part).is_dir() else f"{part}.py" for part in parts}


def test_whatever_computes_takes_only_from_what_a_store_knows_evaluations_by() -> None:
    files = [path for name in COMPUTING for path in (HOME / name, *(HOME / name).rglob("*.py")) if path.is_file()]
    assert len(files) > 100
    strangers = {
        str(file.relative_to(HOME)): found for file in files if (found := imported(file) - {*COMPUTING, "_core.py"})
    }
    assert strangers == {}
