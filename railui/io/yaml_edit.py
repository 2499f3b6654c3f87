"""Editing values of a YAML text in place; comments and layout remain."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from railui.io.problems import FileProblems, Findings
from railui.io.yaml_document import Document, parse_yaml
from railui.io.yaml_nodes import Node
from railui.io.yaml_writer import scalar_text, text_in_unit_of


def edit_values(text: str, changes: Mapping[str, Any], file: str = "text") -> str:
    """Change or add values at dotted paths of a YAML text.

    A number that replaces a quantity is written in the unit of that quantity. Groups are added as required.

    Raises
    ------
    FileProblems
        If the text is not YAML, or a path cannot be edited.

    Examples
    --------
    >>> edit_values("primary: {lateral_stiffness: 3.0 MN/m}  # soft", {"primary.lateral_stiffness": 3.2e6})
    'primary: {lateral_stiffness: 3.2 MN/m}  # soft'
    """
    for path, value in changes.items():
        document = parse_yaml(text, file)
        edited = _edit(document, path, value)
        _check_edit(document, edited, path)
        text = edited
    return text


def _edit(document: Document, path: str, value: Any) -> str:
    findings, node, steps = document.findings(), document.root, path.split(".")
    while steps:
        if node.alias:
            findings.add(path, "is part of an alias, an edit would change the anchor too", "write the group out")
            findings.raise_errors()
        # a key may itself be a dotted path
        count = next((n for n in range(len(steps), 0, -1) if ".".join(steps[:n]) in node.children), 0)
        if count == 0:
            return _add(document, node, steps, value, path, findings)
        node, steps = node.children[".".join(steps[:count])], steps[count:]
    return _replace(document.text, node, _value_text(value, node.value))


def _replace(text: str, node: Node, value: str) -> str:
    before, after = text[: node.start], text[node.end :]
    if node.start == node.end and before.endswith((":", "-")):
        value = f" {value}"  # `key:` without a value
    elif node.kind != "scalar" and not node.flow and before.rstrip().endswith(":"):
        before, value = before.rstrip(), f" {value}"  # a block below its key becomes one line
    elif text[node.start : node.end].endswith("\n"):
        value = f"{value}\n"  # a text block with its last line end
    return before + value + after


def _value_text(value: Any, before: Any = None) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{scalar_text(k)}: {_value_text(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value_text(v) for v in value) + "]"
    if isinstance(value, float) or (isinstance(value, int) and not isinstance(value, bool)):
        return text_in_unit_of(value, before)
    return scalar_text(value)


def _add(document: Document, node: Node, steps: list[str], value: Any, path: str, findings: Findings) -> str:
    if node.kind == "list" and not (steps[0].isdecimal() and int(steps[0]) == len(node.children)):
        findings.add(path, f"the list has {len(node.children)} entries", f"name one of 0 to {len(node.children)}")
    elif node.kind == "scalar" and node.value is not None:
        findings.add(path, "is not a group", "name a path below a group")
    findings.raise_errors()
    entry = _value_text(value)
    for step in reversed(steps[1:]):
        entry = f"{{{step}: {entry}}}"
    if node.kind == "scalar":
        return _replace(document.text, node, f"{{{steps[0]}: {entry}}}")
    line = entry if node.kind == "list" else f"{steps[0]}: {entry}"
    return _insert_into_flow(document.text, node, line) if node.flow else _insert_into_block(document.text, node, line)


def _insert_into_flow(text: str, node: Node, entry: str) -> str:
    """Insert an entry after the last child, or between empty brackets."""
    if not node.children:
        return text[: node.start + 1] + entry + text[node.end - 1 :]
    at = max(child.end for child in node.children.values())
    return f"{text[:at]}, {entry}{text[at:]}"


def _insert_into_block(text: str, node: Node, entry: str) -> str:
    """Insert an entry as a line after the last child."""
    newline = "\r\n" if "\r\n" in text else "\n"
    end = text.find("\n", node.end)
    end = len(text) if end < 0 else end + 1
    head = text[:end] if text[:end].endswith("\n") else text[:end] + newline
    first = text.rfind("\n", 0, node.start) + 1
    indent = " " * (node.start - first)
    return f"{head}{indent}{'- ' if node.kind == 'list' else ''}{entry}{newline}{text[end:]}"


def _check_edit(document: Document, edited: str, path: str) -> None:
    """Parse the edited text; report an error if anything but the path and its groups has changed."""
    try:
        after = parse_yaml(edited, document.file).value
    except FileProblems:
        after = None
    old, new = _leaves(document.value), _leaves(after)
    moved = [p for p in old.keys() | new.keys() if old.get(p, old) != new.get(p, new) and not _is_related(p, path)]
    if after is None or moved or not any(p == path or p.startswith(f"{path}.") for p in new):
        findings = document.findings()
        findings.add(path, "cannot be edited in this layout", "change the line by hand")
        findings.raise_errors()


def _is_related(changed: str, path: str) -> bool:
    return changed == path or changed.startswith(f"{path}.") or path.startswith(f"{changed}.")


def _leaves(value: Any, path: str = "") -> dict[str, Any]:
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        inner = {p: v for k, child in items for p, v in _leaves(child, f"{path}.{k}" if path else str(k)).items()}
        return inner or {path: type(value).__name__}
    return {path: value}
