"""YAML nodes with spans and positions: scalars of the 1.2 core schema, limits on depth and size."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import yaml

from railui.io.problems import FileProblems, Findings, Position, file_problem

MAX_DEPTH = 20
MAX_VALUES = 200_000  # with aliases expanded; bounds expansion attacks
MAX_INTEGER_DIGITS = 240  # longer integers exceed a double in any base, and are slow to parse

NULL = re.compile(r"(?:null|Null|NULL|~|)\Z")
TRUE, FALSE = re.compile(r"(?:true|True|TRUE)\Z"), re.compile(r"(?:false|False|FALSE)\Z")
INTEGER, OCTAL, HEXADECIMAL = (
    re.compile(r"[-+]?[0-9]+\Z"),
    re.compile(r"0o[0-7]+\Z"),
    re.compile(r"0x[0-9a-fA-F]+\Z"),
)
FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?\Z")
INFINITE, NOT_A_NUMBER = re.compile(r"[-+]?\.(?:inf|Inf|INF)\Z"), re.compile(r"\.(?:nan|NaN|NAN)\Z")
TAGS = {f"tag:yaml.org,2002:{name}" for name in ("str", "int", "float", "bool", "null", "map", "seq")}


@dataclass
class Node:
    """Value of a YAML text: span, position, and for groups their style and children."""

    start: int
    end: int
    position: Position
    value: Any = None
    flow: bool = False
    children: dict[str, Node] = field(default_factory=dict)
    key_positions: dict[str, Position] = field(default_factory=dict)
    kind: str = "scalar"  # or "map", "list"
    alias: bool = False


def parse_scalar(text: str) -> Any:
    """Parse a plain scalar by the core schema of YAML 1.2.

    >>> [parse_scalar(text) for text in ("1e6", "on", "0o17", "true", "~")]
    [1000000.0, 'on', 15, True, None]
    """
    readers: tuple[tuple[re.Pattern[str], Callable[[str], Any]], ...] = (
        (NULL, lambda t: None),
        (TRUE, lambda t: True),
        (FALSE, lambda t: False),
        (INTEGER, lambda t: int(t) if len(t) < MAX_INTEGER_DIGITS else float(t)),
        (OCTAL, lambda t: int(t[2:], 8) if len(t) < MAX_INTEGER_DIGITS else math.inf),
        (HEXADECIMAL, lambda t: int(t, 16) if len(t) < MAX_INTEGER_DIGITS else math.inf),
        (FLOAT, float),
        (INFINITE, lambda t: float(t.replace(".", ""))),
        (NOT_A_NUMBER, lambda t: float("nan")),
    )
    return next((read(text) for pattern, read in readers if pattern.match(text)), text)


def join_path(path: str, name: str) -> str:
    """Append a name to a dotted path."""
    return f"{path}.{name}" if path else name


class Composer:
    """Builder of nodes from parser events, with bounded depth."""

    def __init__(self, file: str) -> None:
        self.file, self.findings = file, Findings(file)
        self.anchors: dict[str, tuple[Node, int, int]] = {}
        self.events: Iterator[Any] = iter(())
        self.values = 0

    def problem(self, event: Any, message: str, remedy: str, path: str = "") -> FileProblems:
        """Return the exception for a problem at an event."""
        return file_problem(self.file, message, remedy, path, position=_position(event))

    def compose_document(self, text: str) -> Node:
        """Return the root of a text; FileProblems if it is not a single document, yaml.YAMLError if not YAML."""
        loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
        self.events = iter(yaml.parse(text, Loader=loader))
        root: Node | None = None
        for event in self.events:
            if isinstance(event, yaml.DocumentStartEvent) and root is not None:
                raise self.problem(event, "a second document begins", "keep one document in a file")
            if isinstance(event, yaml.NodeEvent):
                root = self.compose_node(event, "", 1)[0]
        if root is None or (root.kind == "scalar" and root.value is None):
            raise file_problem(self.file, "is empty", "write `key: value` lines", position=(1, 1))
        return root

    def compose_node(self, event: Any, path: str, depth: int) -> tuple[Node, int, int]:
        """Return the node of an event, its number of values and its depth."""
        if depth > MAX_DEPTH:
            raise self.problem(event, f"is nested deeper than {MAX_DEPTH}", "flatten it", path)
        if isinstance(event, yaml.AliasEvent):
            made = self.compose_alias(event, path, depth)
        elif isinstance(event, yaml.ScalarEvent):
            made = self.compose_scalar(event, path), 1, 1
        elif isinstance(event, yaml.MappingStartEvent):
            made = self.compose_mapping(event, path, depth)
        else:
            made = self.compose_sequence(event, path, depth)
        if self.values + made[1] > MAX_VALUES:
            raise self.problem(event, f"holds more than {MAX_VALUES} values", "write fewer aliases", path)
        if not isinstance(event, yaml.AliasEvent) and event.anchor is not None:
            self.anchors[event.anchor] = made
        return made

    def compose_alias(self, event: Any, path: str, depth: int) -> tuple[Node, int, int]:
        """Return the node of an alias, with the alias's position; its values count again."""
        if event.anchor not in self.anchors:
            raise self.problem(
                event, f"the alias *{event.anchor} has no anchor &{event.anchor} before it", "write the value out", path
            )
        node, size, height = self.anchors[event.anchor]
        if depth + height - 1 > MAX_DEPTH:
            raise self.problem(event, f"is nested deeper than {MAX_DEPTH}", "flatten it", path)
        self.values += size
        if self.values > MAX_VALUES:
            raise self.problem(event, f"holds more than {MAX_VALUES} values", "write fewer aliases", path)
        same = Node(
            _start(event),
            _end(event),
            _position(event),
            node.value,
            node.flow,
            node.children,
            node.key_positions,
            node.kind,
            True,
        )
        return same, size, height

    def compose_scalar(self, event: Any, path: str) -> Node:
        """Return a word or number; a tag determines its type."""
        self.check_tag(event, path)
        value: Any = event.value
        named = (event.tag or "").rpartition(":")[2]
        if (event.implicit[0] and not event.tag) or named in ("int", "float", "bool", "null"):
            value = parse_scalar(event.value)
        if named == "float" and isinstance(value, int):
            value = float(value)
        return Node(_start(event), _end(event), _position(event), value)

    def compose_mapping(self, event: Any, path: str, depth: int) -> tuple[Node, int, int]:
        """Return a group of keys; report duplicate keys."""
        self.check_tag(event, path)
        node = Node(_start(event), _end(event), _position(event), flow=bool(event.flow_style), kind="map")
        size, height = 1, 1
        for key in self.events:
            if isinstance(key, yaml.MappingEndEvent):
                node.end = _end(key) if node.flow else _block_end(node)
                break
            if not isinstance(key, yaml.ScalarEvent):
                raise self.problem(key, "a key that is not a word", "write `name: value`", path)
            name = key.value
            child, n, deep = self.compose_node(next(self.events), join_path(path, name), depth + 1)
            if name in node.children:
                line = node.key_positions[name][0]
                self.findings.add(
                    join_path(path, name),
                    f"occurs twice (first in line {line})",
                    "keep one of them",
                    position=_position(key),
                )
            node.children.setdefault(name, child)
            node.key_positions.setdefault(name, _position(key))
            size, height = size + n, max(height, deep + 1)
        return node, size, height

    def compose_sequence(self, event: Any, path: str, depth: int) -> tuple[Node, int, int]:
        """Return a list; the names of its entries are their indices."""
        self.check_tag(event, path)
        node = Node(_start(event), _end(event), _position(event), flow=bool(event.flow_style), kind="list")
        size, height = 1, 1
        for item in self.events:
            if isinstance(item, yaml.SequenceEndEvent):
                node.end = _end(item) if node.flow else _block_end(node)
                break
            name = str(len(node.children))
            child, n, deep = self.compose_node(item, join_path(path, name), depth + 1)
            node.children[name] = child
            size, height = size + n, max(height, deep + 1)
        return node, size, height

    def check_tag(self, event: Any, path: str) -> None:
        """Report a tag outside the core schema."""
        if event.tag and event.tag != "!" and event.tag not in TAGS:
            self.findings.add(
                path, f"the tag {event.tag} is not read", "write the plain value", position=_position(event)
            )


def _start(event: Any) -> int:
    return int(event.start_mark.index)


def _end(event: Any) -> int:
    return int(event.end_mark.index)


def _position(event: Any) -> Position:
    return event.start_mark.line + 1, event.start_mark.column + 1


def _block_end(node: Node) -> int:
    """Return the end of a block group; the parser's end mark includes the comments that follow."""
    return max([child.end for child in node.children.values()], default=node.end)
