"""Changed versions of a module, one change each, by the operators of mutmut."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import libcst as cst
from libcst.metadata import MetadataWrapper, PositionProvider
from mutmut.mutation.mutators import mutation_operators


@dataclass(frozen=True)
class Mutant:
    """A module with one change: its source, and the changed line before and after."""

    line: int
    before: str
    after: str
    source: str


class _Changes(cst.CSTVisitor):
    """Collector of every node that is executed and of what the operators make of it."""

    METADATA_DEPENDENCIES = (PositionProvider,)

    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[cst.CSTNode, cst.CSTNode]] = []

    def on_visit(self, node: cst.CSTNode) -> bool:
        """Collect the changes of a node; skip annotations, decorators, imports and docstrings."""
        if isinstance(node, cst.Annotation | cst.Decorator | cst.Import | cst.ImportFrom):
            return False
        if isinstance(node, cst.Expr) and isinstance(node.value, cst.SimpleString | cst.ConcatenatedString):
            return False
        for kind, operator in mutation_operators:
            if isinstance(node, kind):
                self.found += [(node, changed) for changed in operator(node)]
        return True


def _first_difference(before: list[str], after: list[str]) -> int:
    pairs = enumerate(zip(before, after, strict=False))
    return next((i for i, (a, b) in pairs if a != b), min(len(before), len(after)) - 1)


def list_mutants(source: str) -> Iterator[Mutant]:
    """Yield the mutants of a module that compile and differ from it."""
    wrapper = MetadataWrapper(cst.parse_module(source), unsafe_skip_copy=True)
    changes = _Changes()
    wrapper.visit(changes)
    known = {source}
    for node, changed in changes.found:
        code = wrapper.module.deep_replace(node, changed).code  # type: ignore[arg-type]
        if code in known or not _compiles(code):
            continue
        known.add(code)
        before, after = source.splitlines(), code.splitlines()
        line = _first_difference(before, after)
        yield Mutant(line + 1, before[line].strip(), after[line].strip(), code)


def _compiles(code: str) -> bool:
    try:
        compile(code, "mutant", "exec")
    except SyntaxError:
        return False
    return True
