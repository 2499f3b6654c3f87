"""The README: its tree and its length."""

from __future__ import annotations

import re
from math import ceil

from tests.docs.transcript import ROOT

CAPTION = 30  # the column at which captions begin
WIDE, TWO_SCREENS = 88, 115


def tree() -> set[str]:
    """The paths of the README's tree: a folder at the margin, what it holds below it."""
    text = (ROOT / "README.md").read_text()
    block = re.search(r"## The tree\n\n```\n(.*?)```", text, re.S)
    assert block is not None
    found: set[str] = set()
    folder = ""
    for line in block[1].splitlines():
        words = line[:CAPTION].split()
        if words and not line.startswith(" "):
            folder = words[-1] if words[-1].endswith("/") else ""
            found |= set(words)
        else:
            found |= {folder + word for word in words}
    return found


def test_every_path_of_the_tree_exists() -> None:
    paths = tree()
    assert len(paths) > 15
    assert sorted(path for path in paths if not (ROOT / path).exists()) == []


def test_every_folder_of_the_package_is_in_the_tree() -> None:
    folders = {f"railui/{p.name}/" for p in (ROOT / "railui").iterdir() if (p / "__init__.py").exists()}
    assert folders - tree() == set()


def test_the_readme_is_two_screens_at_most() -> None:
    lines = (ROOT / "README.md").read_text().splitlines()
    assert sum(max(1, ceil(len(line) / WIDE)) for line in lines) <= TWO_SCREENS
