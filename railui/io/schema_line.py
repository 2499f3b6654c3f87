"""The first line of files that railui writes: `schema: railui.KIND/1`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from railui.io.problems import Findings

VERSION = 1
KEYS = {
    "study": ("variables", "objectives", "cases"),
    "campaign": ("runs", "adjust", "noise"),
    "design": ("vehicle", "contact"),
}  # that tell a file without a schema line
LINE = re.compile(r"railui\.([a-z]+)/(\d{1,6})\Z")


def schema_name(kind: str) -> str:
    """The value of the schema line.

    >>> schema_name("design")
    'railui.design/1'
    """
    return f"railui.{kind}/{VERSION}"


def kind_of(data: Any) -> str | None:
    """The kind of a document: what its schema line names, else what its keys tell; None where nothing does.

    >>> kind_of({"schema": "railui.loop/1"}), kind_of({"vehicle": "a.yaml", "runs": []}), kind_of([])
    ('loop', 'campaign', None)
    """
    if not isinstance(data, Mapping):
        return None
    match = LINE.match(str(data.get("schema", "")))
    return match[1] if match else next((kind for kind, keys in KEYS.items() if any(key in data for key in keys)), None)


def check_schema(data: Mapping[str, Any], kind: str, findings: Findings) -> None:
    """No schema line is well; another kind or a newer version is a problem."""
    if "schema" not in data:
        return
    match = LINE.match(str(data["schema"]))
    if match is None or match[1] != kind:
        findings.add(
            "schema",
            f"{data['schema']!r} is no {kind}",
            f"write `schema: {schema_name(kind)}`, or leave the line out",
        )
    elif int(match[2]) > VERSION:
        findings.add(
            "schema",
            f"version {match[2]} is newer than the {VERSION} that this railui reads",
            "take a newer railui",
        )
