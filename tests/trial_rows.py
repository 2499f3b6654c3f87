"""Rows of a trial in a CSV file, one dataclass per row, so that a trial resumes."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar

Row = TypeVar("Row")


def read_rows(path: Path, kind: type[Row]) -> list[Row]:
    """Read the rows of a trial; none where there is no file yet."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return [
            kind(**{f.name: _value(str(f.type), raw[f.name]) for f in fields(kind)})  # type: ignore[arg-type]
            for raw in csv.DictReader(file)
        ]


def _value(kind: str, text: str) -> object:
    if kind in ("bool", "bool | None"):
        return {"True": True, "False": False}.get(text)
    return {"int": int, "float": float}.get(kind, str)(text)


def append_rows(path: Path, rows: Sequence[Any]) -> None:
    """Append rows to the file of a trial, with the header first."""
    if not rows:
        return
    is_new = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, [f.name for f in fields(rows[0])], lineterminator="\n")
        if is_new:
            writer.writeheader()
        writer.writerows(asdict(row) for row in rows)
