"""The tree and the length of the README."""

from __future__ import annotations

import re
from math import ceil

from tests.docs.transcript import ROOT

CAPTION_COLUMN = 30
SCREEN_WIDTH = 88  # characters per line of the rendered page
MAX_LINES = 115  # two screens


def tree() -> set[str]:
    """Return the paths of the README's tree: folders at the margin, their content indented below."""
    text = (ROOT / "README.md").read_text()
    block = re.search(r"## The tree\n\n```\n(.*?)```", text, re.S)
    assert block is not None
    paths: set[str] = set()
    folder = ""
    for line in block[1].splitlines():
        words = line[:CAPTION_COLUMN].split()
        if words and not line.startswith(" "):
            folder = words[-1] if words[-1].endswith("/") else ""
            paths |= set(words)
        else:
            paths |= {folder + word for word in words}
    return paths


def test_every_path_of_the_tree_exists() -> None:
    paths = tree()
    assert len(paths) > 15
    assert sorted(path for path in paths if not (ROOT / path).exists()) == []


def test_every_package_is_in_the_tree() -> None:
    folders = {f"railui/{p.name}/" for p in (ROOT / "railui").iterdir() if (p / "__init__.py").exists()}
    assert folders - tree() == set()


def test_the_readme_has_at_most_two_screens() -> None:
    lines = (ROOT / "README.md").read_text().splitlines()
    assert sum(max(1, ceil(len(line) / SCREEN_WIDTH)) for line in lines) <= MAX_LINES
