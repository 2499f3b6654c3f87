"""Designs that a campaign or a study names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from railui.io.problems import FileProblems, Findings, suggest_name
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.effects import Catalogue

CALIBRATED_FILE = "adjusted.yaml"
MADE = "railui loop writes it: run the loop first, or name the directory that it wrote with -o"


def load_named_design(
    source: Path, data: Mapping[str, Any], findings: Findings, catalogue: Catalogue | None
) -> Design | None:
    """Load the design that `vehicle:` names, relative to the file; its problems join `findings`."""
    named = data.get("vehicle")
    if named is None or isinstance(named, list | dict | float):
        return None  # reported by the validation model
    path = source.parent / str(named)
    if not path.is_file():
        made = path.name == CALIBRATED_FILE and not path.parent.is_dir()
        findings.add("vehicle", f"no file {named!r}", MADE if made else suggest_file(path, source.parent))
        return None
    try:
        return load_design(path, catalogue)
    except FileProblems as error:
        findings.problems += error.problems
        return None


def suggest_file(path: Path, home: Path) -> str:
    """Return the remedy for a missing file that a file in `home` names: the nearest existing name."""
    names = sorted(p.name for p in path.parent.iterdir()) if path.parent.is_dir() else []
    suggestion = suggest_name(path.name, names)
    return suggestion if suggestion.startswith("did you mean") else f"give a path relative to {home}"
