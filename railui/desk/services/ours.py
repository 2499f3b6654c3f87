"""Our files on this disk: which kind one is, and which there are below a directory."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from railui.io.problems import FileProblems
from railui.io.schema_line import kind_of as kind_of_document
from railui.io.yaml_document import load as load_yaml

MOST_FILES = 400
DEEPEST = 5


def kind_of(path: Path) -> str:
    """Which of our files this is: a campaign (or a directory), a study, or else a design."""
    if path.is_dir():
        return "campaign"
    try:
        kind = kind_of_document(load_yaml(path).value)
    except (FileProblems, OSError):
        kind = None
    return kind if kind in ("campaign", "study") else "design"  # whose faults are told when it is read


def files_below(directory: Path, patterns: Sequence[str] = ("*.yaml", "*.yml")) -> list[Path]:
    """Files below a directory, not those of hidden or built ones, at most so many."""
    found: list[Path] = []
    heap = [(directory, 0)]
    while heap and len(found) < MOST_FILES:
        here, depth = heap.pop(0)
        try:
            entries = sorted(here.iterdir())
        except OSError:
            continue
        found += [e for e in entries if e.is_file() and any(e.match(p) for p in patterns)]
        if depth < DEEPEST:
            heap += [
                (e, depth + 1)
                for e in entries
                if e.is_dir() and not e.name.startswith(".") and e.name not in ("target", "node_modules", "__pycache__")
            ]
    return found[:MOST_FILES]
