"""YAML file of one kind, such as a campaign or a study: its root, its schema line and its fields."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from railui.io.fields import Model, check_group
from railui.io.problems import Findings
from railui.io.schema_line import check_schema
from railui.io.yaml_document import load_yaml


def load_fields(
    path: str | Path, kind: str, schema: type[Model], remedy: str | None = None
) -> tuple[dict[str, Any], Model | None, Findings]:
    """Read a file of a kind by the schema of its fields.

    Parameters
    ----------
    path : str or Path
    kind : str
        Kind in the schema line, such as "campaign".
    schema : type
        Pydantic model of the fields.
    remedy : str, optional
        Remedy for a file without a key, which is then an error by itself.

    Returns
    -------
    (dict, Model or None, Findings)
        The file as read, its checked fields (None if one is faulty), and the collector of its problems.

    Raises
    ------
    FileProblems
        For a file that is not YAML, and with `remedy` for one without a key.
    """
    document = load_yaml(path)
    findings = document.findings()
    data = document.value if isinstance(document.value, dict) else {}
    if not data and remedy is not None:
        findings.add("", f"is not {'an' if kind[0] in 'aeiou' else 'a'} {kind}", remedy)
        findings.raise_errors()
    check_schema(data, kind, findings)
    return data, check_group(schema, data, findings), findings
