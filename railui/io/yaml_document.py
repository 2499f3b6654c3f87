"""YAML 1.2 documents: nested plain values and the position of each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from railui.io.problems import Findings, Position, file_problem, refuse_stream, unreadable_file
from railui.io.yaml_nodes import Composer, Node, join_path

MAX_BYTES = 1_000_000  # bytes
GZIP = b"\x1f\x8b"


@dataclass(frozen=True)
class Document:
    """YAML document: text, nested values, nodes, and the position of each dotted path."""

    file: str
    text: str
    value: Any
    root: Node
    positions: dict[str, Position]
    key_positions: dict[str, Position]

    def findings(self) -> Findings:
        """Return an empty collector of problems with the positions of this document."""
        return Findings(self.file, self.positions, self.key_positions)


def read_text(path: str | Path, file: str | None = None) -> str:
    """Read a text file of at most 1 MB in UTF-8, without its byte order mark; FileProblems otherwise."""
    name = file or str(path)
    refuse_stream(path)
    try:
        with Path(path).open("rb") as handle:
            data = handle.read(MAX_BYTES + 1)
    except OSError as error:
        raise unreadable_file(name, error) from None
    if len(data) > MAX_BYTES:
        raise file_problem(name, f"is larger than {MAX_BYTES} bytes", "keep measured data in separate CSV files")
    if data.startswith(GZIP):
        raise file_problem(name, "is compressed (gzip), as runs are", "give a text file, such as a design in YAML")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        place = before.count(b"\n") + 1, error.start - before.rfind(b"\n")
        raise file_problem(
            name, f"byte 0x{data[error.start]:02x} is not UTF-8", "save the file as UTF-8", position=place
        ) from None


def _syntax_remedy(text: str, place: Position) -> str:
    """Return the remedy for a line that is not YAML: most often brackets, or a tab."""
    line = text.splitlines()[place[0] - 1 :][:1]
    if line and line[0][: place[1]].endswith("\t"):
        return "replace the tab by spaces"
    return "correct the brackets, quotes or indentation"


def parse_yaml(text: str, file: str = "text") -> Document:
    """Parse one YAML document; FileProblems for duplicate keys and for text that is not YAML.

    >>> parse_yaml("contact: {leading: {conicity: 15e-2}}").positions["contact.leading.conicity"]
    (1, 31)
    """
    if len(text) > MAX_BYTES:
        raise file_problem(file, f"is larger than {MAX_BYTES} characters", "keep measured data in separate CSV files")
    composer = Composer(file)
    try:
        root = composer.compose_document(text)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        raise file_problem(
            file, f"is not YAML here: {error.problem or error}", _syntax_remedy(text, place), position=place
        ) from None
    except yaml.YAMLError as error:
        raise file_problem(
            file, f"is not YAML: {str(error).splitlines()[0]}", "write it as plain UTF-8 text", position=(1, 1)
        ) from None
    composer.findings.raise_errors()
    marks: dict[str, Position] = {}
    keys: dict[str, Position] = {}
    for path, node in iter_nodes(root):
        marks[path] = node.position
        keys.update({join_path(path, name): place for name, place in node.key_positions.items()})
    return Document(file, text, to_plain(root), root, marks, keys)


def load_yaml(path: str | Path) -> Document:
    """Read and parse a YAML file; FileProblems as `parse_yaml`."""
    return parse_yaml(read_text(path), str(path))


def iter_nodes(node: Node, path: str = "") -> Iterator[tuple[str, Node]]:
    """Yield every node with its dotted path, the root first."""
    yield path, node
    for name, child in node.children.items():
        yield from iter_nodes(child, join_path(path, name))


def to_plain(node: Node) -> Any:
    """Return a node as nested dicts, lists and scalars."""
    if node.kind == "map":
        return {name: to_plain(child) for name, child in node.children.items()}
    return [to_plain(child) for child in node.children.values()] if node.kind == "list" else node.value
