"""railui diff: what differs between two designs, studies or campaigns."""

from __future__ import annotations

from typing import Any

import click

from railui.cli.common import Invocation, options


@click.command("diff")
@click.argument("a", metavar="A.yaml")
@click.argument("b", metavar="B.yaml")
@options
def command(a: str, b: str, call: Invocation) -> None:
    """Tell every number and word in which B.yaml differs from A.yaml, units and defaults resolved."""
    from railui.documents.difference import differences

    rows = differences(a, b)
    call.show(_table(rows, a, b) if rows else "no difference")
    call.emit(call.document("diff", {"differences": rows}, [a, b]))


def _table(rows: list[dict[str, Any]], a: str, b: str) -> Any:
    from rich.table import Table

    table = Table("path", a, b, "change")
    for row in rows:
        change = "" if row["relative"] is None else f"{100 * row['relative']:+.3g} %"
        table.add_row(row["path"], *(_text(row[key], row["unit"]) for key in ("a", "b")), change)
    return table


def _text(value: Any, unit: str) -> str:
    from railui.io.number_format import display

    if value is None:
        return "-"
    return display(value, unit) if isinstance(value, float) and unit else str(value)
