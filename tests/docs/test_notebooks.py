"""The notebooks of examples/ run without a screen, and the manual lists them."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.transcript import ROOT, TIMEOUT, copy_bundled_files

NOTEBOOKS = sorted((ROOT / "examples").glob("*.py"))


# `make docs` executes all of them
RUN = [pytest.param(p, id=p.stem, marks=() if p.stem == "first_ride" else pytest.mark.slow) for p in NOTEBOOKS]


@pytest.mark.parametrize("notebook", RUN)
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
    assert sorted(listed) == [path.stem for path in NOTEBOOKS] and len(listed) == 5


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_consists_of_cells_of_text_and_code(notebook: Path) -> None:
    text = notebook.read_text()
    cells = re.findall(r"^# %%(.*)$", text, flags=re.M)
    assert cells[0] == " [markdown]" and set(cells) == {"", " [markdown]"}
    assert text.splitlines()[0] == "# ---" and "format_name: percent" in text.splitlines()[2]


SMALL = """# %% [markdown]
# # Small
#
# Text.

# %%
from matplotlib import pyplot

print(6 * 7)
pyplot.plot([1.0, 2.0])

# %%
import railui

railui.Design.load("designs/test_bogie.yaml")
"""


def test_a_page_has_the_text_the_output_and_the_figure_of_every_cell(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    spec = importlib.util.spec_from_file_location("notebooks", ROOT / "docs/from_code/notebooks.py")
    assert spec is not None and spec.loader is not None
    notebooks = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(notebooks)
    rendered = notebooks.render("small", SMALL)
    heading, link, text = rendered.page.split("\n\n")[:3]
    assert (heading, text) == ("# Small", "Text.") and "`examples/small.py`" in link
    assert "```text\n42\n```\n\n![figure 1 of the notebook](small_1.svg)" in rendered.page
    assert "<table" in rendered.page and rendered.figures["small_1.svg"].startswith(b"<?xml")
    with pytest.raises(ZeroDivisionError):
        notebooks.render("small", "# %%\n1 / 0\n")
