"""Schema line of YAML files, `schema: railui.KIND/1`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from railui.io.problems import Findings

SCHEMA_VERSION = 1
KEYS_BY_KIND = {
    "fleet": ("types", "vehicles", "triggers"),
    "study": ("variables", "objectives", "cases"),
    "plan": ("costs", "budget"),
    "campaign": ("runs", "adjust", "noise"),
    "map": ("sensors", "rails", "convention", "speed"),
    "design": ("vehicle", "contact"),
    "line": ("segments", "irregularity"),
}  # that identify a file without a schema line
SCHEMA_NAME = re.compile(r"railui\.([a-z]+)/(\d{1,6})\Z")


def schema_name(kind: str) -> str:
    """Return the value of the schema line.

    >>> schema_name("design")
    'railui.design/1'
    """
    return f"railui.{kind}/{SCHEMA_VERSION}"


def document_kind(data: Any) -> str | None:
    """Return the kind of a document from its schema line, else from its keys; None if unknown.

    >>> document_kind({"schema": "railui.loop/1"}), document_kind({"vehicle": "a.yaml", "runs": []})
    ('loop', 'campaign')
    >>> document_kind([])

    """
    if not isinstance(data, Mapping):
        return None
    match = SCHEMA_NAME.match(str(data.get("schema", "")))
    return (
        match[1]
        if match
        else next((kind for kind, keys in KEYS_BY_KIND.items() if any(key in data for key in keys)), None)
    )


def check_schema(data: Mapping[str, Any], kind: str, findings: Findings) -> None:
    """Report a schema line of another kind or of a newer version; a missing one is accepted."""
    if "schema" not in data:
        return
    match = SCHEMA_NAME.match(str(data["schema"]))
    if match is None or match[1] != kind:
        findings.add(
            "schema",
            f"{data['schema']!r} is not the schema of a {kind}",
            f"write `schema: {schema_name(kind)}`, or leave the line out",
        )
    elif int(match[2]) > SCHEMA_VERSION:
        findings.add(
            "schema",
            f"version {match[2]} is newer than version {SCHEMA_VERSION}, the newest that this railui reads",
            "install a newer railui",
        )
