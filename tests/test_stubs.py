"""Stubs of the compiled kernel have the names, arguments and defaults of the module."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path
from types import ModuleType
from typing import Any

import railui
from railui import _core

STUBS = ast.parse((Path(railui.__file__).parent / "_core.pyi").read_text())
Node = ast.Module | ast.ClassDef


def stub_names(node: Node) -> dict[str, ast.stmt]:
    """Return the public names of a stub."""
    found: dict[str, ast.stmt] = {}
    for entry in node.body:
        if isinstance(entry, ast.FunctionDef | ast.ClassDef):
            found[entry.name] = entry
        elif isinstance(entry, ast.AnnAssign) and isinstance(entry.target, ast.Name):
            found[entry.target.id] = entry
    return found


def module_names(thing: ModuleType | type[Any]) -> set[str]:
    """Return the public names of a module or class."""
    return {name for name in vars(thing) if not name.startswith("_")}


def arguments(function: ast.FunctionDef) -> list[tuple[str, Any]]:
    """Return names and defaults of a stub's arguments, without self."""
    names = [a.arg for a in function.args.args]
    defaults = [inspect.Parameter.empty] * (len(names) - len(function.args.defaults))
    values = [*defaults, *(ast.literal_eval(d) for d in function.args.defaults)]
    return [(name, value) for name, value in zip(names, values, strict=True) if name != "self"]


def signature(thing: Any) -> list[tuple[str, Any]]:
    return [(p.name, p.default) for p in inspect.signature(thing).parameters.values() if p.name != "self"]


def test_the_stub_names_what_the_module_has() -> None:
    assert set(stub_names(STUBS)) == module_names(_core)


def test_the_stub_of_a_class_names_its_methods() -> None:
    for name, entry in stub_names(STUBS).items():
        if isinstance(entry, ast.ClassDef):
            assert {m for m in stub_names(entry) if m != "__init__"} == module_names(getattr(_core, name)), name


def test_arguments_and_defaults_are_those_of_the_module() -> None:
    compared = 0
    for name, entry in stub_names(STUBS).items():
        thing = getattr(_core, name)
        if isinstance(entry, ast.FunctionDef):
            assert arguments(entry) == signature(thing), name
            compared += 1
        for inner, method in stub_names(entry).items() if isinstance(entry, ast.ClassDef) else ():
            assert isinstance(method, ast.FunctionDef)
            expected = signature(thing) if inner == "__init__" else signature(getattr(thing, inner))
            assert arguments(method) == expected, f"{name}.{inner}"
            compared += 1
    assert compared > 10
