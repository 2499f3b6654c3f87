"""The notebooks of examples/ run without a screen, and the manual lists them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.transcript import ROOT, TIMEOUT, copy_bundled_files

NOTEBOOKS = sorted((ROOT / "examples").glob("*.py"))


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_without_a_screen(notebook: Path, tmp_path: Path) -> None:
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    done = subprocess.run(
        [sys.executable, str(notebook)],
        cwd=copy_bundled_files(tmp_path),
        env=environment,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_the_manual_lists_every_notebook() -> None:
    listed = re.findall(r"^\| `examples/(\w+)\.py` \|", (ROOT / "docs/python.md").read_text(), flags=re.M)
    assert sorted(listed) == [path.stem for path in NOTEBOOKS] and len(listed) >= 2


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_consists_of_cells_of_text_and_code(notebook: Path) -> None:
    text = notebook.read_text()
    cells = re.findall(r"^# %%(.*)$", text, flags=re.M)
    assert cells[0] == " [markdown]" and set(cells) == {"", " [markdown]"}
    assert text.splitlines()[0] == "# ---" and "format_name: percent" in text.splitlines()[2]
