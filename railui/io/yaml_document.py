"""YAML 1.2 with marks: nested plain values, and where each of them stands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from railui.io.problems import Findings, Place, one_problem, unread
from railui.io.yaml_nodes import Composer, Node, join

LARGEST = 1_000_000  # bytes
GZIP = b"\x1f\x8b"


@dataclass(frozen=True)
class Document:
    """A file as read: text, plain nested values, nodes, and the marks of each dotted path."""

    file: str
    text: str
    value: Any
    root: Node
    marks: dict[str, Place]
    keys: dict[str, Place]

    def findings(self) -> Findings:
        """An empty list of problems that knows this document's marks."""
        return Findings(self.file, self.marks, self.keys)


def read_text(path: str | Path, file: str | None = None) -> str:
    """A text file of at most 1 MB in UTF-8, a byte order mark taken off; FileProblems otherwise."""
    name = file or str(path)
    try:
        with Path(path).open("rb") as handle:
            data = handle.read(LARGEST + 1)
    except OSError as error:
        raise unread(name, error) from None
    if len(data) > LARGEST:
        raise one_problem(name, f"is larger than {LARGEST} bytes", "keep measured data in CSV files beside it")
    if data.startswith(GZIP):
        raise one_problem(name, "is compressed (gzip), as runs are", "give a text file, such as a design in YAML")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        place = before.count(b"\n") + 1, error.start - before.rfind(b"\n")
        raise one_problem(
            name, f"byte 0x{data[error.start]:02x} is no UTF-8", "save the file as UTF-8", place=place
        ) from None


def _mend(text: str, place: Place) -> str:
    """What to do about a line that is no YAML: most often brackets, or a tab that an editor set."""
    line = text.splitlines()[place[0] - 1 :][:1]
    if line and line[0][: place[1]].endswith("\t"):
        return "a tab stands there: indent by spaces"
    return "mend the brackets, quotes or indents"


def parse(text: str, file: str = "text") -> Document:
    """Reads one document; FileProblems names every duplicate key, and where the text is no YAML.

    >>> parse("contact: {leading: {conicity: 15e-2}}").marks["contact.leading.conicity"]
    (1, 31)
    """
    if len(text) > LARGEST:
        raise one_problem(file, f"is larger than {LARGEST} characters", "keep measured data in CSV files beside it")
    composer = Composer(file)
    try:
        root = composer.document(text)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        raise one_problem(file, f"is no YAML here: {error.problem or error}", _mend(text, place), place=place) from None
    except yaml.YAMLError as error:
        raise one_problem(
            file, f"is no YAML: {str(error).splitlines()[0]}", "write it as plain UTF-8 text", place=(1, 1)
        ) from None
    composer.findings.stop()
    marks: dict[str, Place] = {}
    keys: dict[str, Place] = {}
    for path, node in walk(root):
        marks[path] = node.place
        keys.update({join(path, name): place for name, place in node.keys.items()})
    return Document(file, text, plain(root), root, marks, keys)


def load(path: str | Path) -> Document:
    """Reads a file; as `parse`."""
    return parse(read_text(path), str(path))


def walk(node: Node, path: str = "") -> Iterator[tuple[str, Node]]:
    """Every node with its dotted path, the root first."""
    yield path, node
    for name, child in node.children.items():
        yield from walk(child, join(path, name))


def plain(node: Node) -> Any:
    """The nested dicts, lists and scalars of a node."""
    if node.kind == "map":
        return {name: plain(child) for name, child in node.children.items()}
    return [plain(child) for child in node.children.values()] if node.kind == "list" else node.value
