"""Choices of the dialogs: effects, search variables, serial ports, files."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from railui.io.problems import FileProblems
from railui.io.schema_line import document_kind
from railui.vehicle.design_reader import Design
from railui.vehicle.effects import PlacedEffect, is_curve, kernel_catalogue

DEMO_PORT: Final = "demo"
MAX_FILES: Final = 400
HEAD_CHARACTERS: Final = 2000  # of a file, in which its kind is stated
TOP_KEY: Final = re.compile(r"^([a-z_]+):(.*)$", re.MULTILINE)
MAX_DEPTH: Final = 5  # levels of directories
SKIPPED_DIRECTORIES: Final = ("target", "node_modules", "__pycache__")


def effect_choices(design: Design) -> list[tuple[str, str]]:
    """List every kind of effect at every location that it can have in a design: key, text."""
    choices = []
    for record in kernel_catalogue():
        if is_curve(record) or record["acts"] == "sensor":  # identified from measurements, not chosen
            continue
        for at in record["at"]:
            if (at == "rig") == (design.kind == "rig"):
                text = f"{record['kind'].replace('_', ' '):22} {at.replace('_', ' '):18} {record['title']}"
                choices.append((f"{record['kind']} {at}", text))
    return choices


def effect_of_choice(key: str) -> PlacedEffect:
    """Return the effect of a choice with default parameters."""
    kind, at = key.split()
    return PlacedEffect(kind, at)


def variable_choices(design: Design) -> list[tuple[str, str]]:
    """List the parameters of a design that a search can vary: path, text."""
    choices = []
    for path in design.paths():
        try:
            p = design.parameter(path)
        except FileProblems:
            continue
        choices.append((path, f"{path:44} {p.caption}"))
    return choices


def port_choices() -> list[tuple[str, str]]:
    """List the demo logger and the serial ports of this machine: name, text."""
    from serial.tools.list_ports import comports

    demo = (DEMO_PORT, f"{DEMO_PORT:16} simulated vehicle with sensors, in a separate process")
    return [demo, *((p.device, f"{p.device:16} {p.description}") for p in sorted(comports(), key=lambda p: p.device))]


def find_files(directory: Path, patterns: Sequence[str] = ("*.yaml", "*.yml")) -> list[Path]:
    """Find at most MAX_FILES files below a directory, without links, hidden and build directories."""
    files: list[Path] = []
    queue = [(directory, 0)]
    while queue and len(files) < MAX_FILES:
        current, depth = queue.pop(0)
        try:
            entries = sorted(current.iterdir())
        except OSError:
            continue
        files += [e for e in entries if e.is_file() and any(e.match(p) for p in patterns)]
        if depth < MAX_DEPTH:
            queue += [(e, depth + 1) for e in entries if _is_searched(e)]
    return files[:MAX_FILES]


def find_documents(directory: Path, kinds: Sequence[str]) -> list[tuple[str, str]]:
    """List the files of some kinds below a directory: path, text."""
    found = [path for path in find_files(directory) if _head_kind(path) in kinds]
    return [(str(path), str(path.relative_to(directory))) for path in found]


def _head_kind(path: Path) -> str | None:
    """Return the kind of a file by the schema line or the keys in its first lines."""
    try:
        with path.open(encoding="utf-8") as stream:
            head = stream.read(HEAD_CHARACTERS)
    except (OSError, UnicodeDecodeError):
        return None
    return document_kind({key: value.strip() for key, value in TOP_KEY.findall(head)})


def _is_searched(entry: Path) -> bool:
    is_hidden = entry.name.startswith(".") or entry.name in SKIPPED_DIRECTORIES
    return entry.is_dir() and not entry.is_symlink() and not is_hidden
