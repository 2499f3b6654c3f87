"""Differences between two files of one kind, by path."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from railui.io.atomic import sha256
from railui.io.problems import FileProblems, file_problem
from railui.io.schema_line import document_kind
from railui.io.yaml_document import load_yaml
from railui.vehicle.design import Design
from railui.vehicle.design_reader import load_design
from railui.vehicle.division import divide_design, divisible_numbers

ABSENT = None


def differences(a: str | Path, b: str | Path) -> list[dict[str, Any]]:
    """Return the differences of two files.

    Designs are compared with their defaults, other files as written.

    Returns
    -------
    list of dict
        Keys path, unit, a, b (SI; None if absent) and relative (b/a - 1), in the order of the files.

    Raises
    ------
    FileProblems
        For faulty files, and for two files of different kinds.
    """
    documents = [load_yaml(path).value for path in (a, b)]
    kinds = [document_kind(document) or "design" for document in documents]
    if kinds[0] != kinds[1]:
        message = f"is a {kinds[1]}, but {a} is a {kinds[0]}"
        raise file_problem(b, message, "compare two files of one kind")
    if kinds[0] != "design":
        first, second = (dict(iter_leaves(document)) for document in documents)
        return _difference_rows(first, second, {})
    designs = _divided_alike([load_design(Path(path)) for path in (a, b)])
    first, second = map(_design_values, designs)
    return _difference_rows(first, second, {path: _unit(designs, path) for path in {**first, **second}})


def _divided_alike(designs: list[Design]) -> list[Design]:
    """Return the designs with a number for each joint where one of them has it."""
    structures = [design.structure for design in designs if design.structure is not None]
    divided = [path for structure in structures for path, _ in structure.divided]
    alike = []
    for design in designs:
        own = {} if design.structure is None else divisible_numbers(design.structure)
        alike.append(divide_design(design, [path for path in divided if path in own]) if own else design)
    return alike


def _design_values(design: Design) -> dict[str, Any]:
    """All that decides what a design does, by path."""
    resolved = design.content()
    riding = {f"riding.{key}": value for key, value in (resolved["riding"] or {}).items()}
    effects = dict(iter_leaves({"effects": [_summarise_curves(effect) for effect in resolved["effects"]]}))
    return {"name": design.name, **resolved["values"], **resolved["settings"], **effects, **riding}


def _summarise_curves(effect: Mapping[str, Any]) -> dict[str, Any]:
    """Return an effect with its curves replaced by length and content hash."""
    summaries = {key: f"{len(x)} values ({sha256(repr(x))[:8]})" for key, x in effect.items() if isinstance(x, list)}
    return {**effect, **summaries}


def _unit(designs: list[Design], path: str) -> str:
    for design in designs:
        try:
            return design.unit(path)
        except FileProblems:
            continue
    return ""


def _difference_rows(
    first: Mapping[str, Any], second: Mapping[str, Any], units: Mapping[str, str]
) -> list[dict[str, Any]]:
    rows = []
    for path in {**first, **second}:
        a, b = first.get(path, ABSENT), second.get(path, ABSENT)
        if a == b:
            continue
        numbers = all(isinstance(x, int | float) and not isinstance(x, bool) for x in (a, b))
        relative = b / a - 1 if numbers and a else None
        rows.append({"path": path, "unit": units.get(path, ""), "a": a, "b": b, "relative": relative})
    return rows


def iter_leaves(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the numbers and words of nested data with their dotted paths.

    >>> dict(iter_leaves({"a": [1, {"b": "c"}]}))
    {'a.0': 1, 'a.1.b': 'c'}
    """
    inner = value.items() if isinstance(value, Mapping) else enumerate(value) if isinstance(value, list) else None
    if inner is None:
        yield name, value
        return
    for key, item in inner:
        yield from iter_leaves(item, f"{name}.{key}" if name else str(key))
