"""Files that a campaign or a study names: where they lie, and the vehicle in one of them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from railui.io.problems import FileProblems, Findings, nearest
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.effect_records import Catalogue

ADJUSTED = "adjusted.yaml"
MADE = "railui loop writes it: run the loop first, or name the directory that it wrote with -o"


def vehicle_of(source: Path, data: Mapping[str, Any], findings: Findings, catalogue: Catalogue | None) -> Design | None:
    """The design that `vehicle:` names, relative to the file; its problems join the findings."""
    named = data.get("vehicle")
    if named is None or isinstance(named, list | dict | float):
        return None  # told by the model
    path = source.parent / str(named)
    if not path.is_file():
        made = path.name == ADJUSTED and not path.parent.is_dir()
        findings.add("vehicle", f"no file {named!r}", MADE if made else neighbour(path, source.parent))
        return None
    try:
        return load_design(path, catalogue)
    except FileProblems as error:
        findings.problems += error.problems
        return None


def neighbour(path: Path, home: Path) -> str:
    """The remedy for a missing file that a file in `home` names: the nearest name beside it."""
    beside = sorted(p.name for p in path.parent.iterdir()) if path.parent.is_dir() else []
    told = nearest(path.name, beside)
    return told if told.startswith("did you mean") else f"give a path relative to {home}"
