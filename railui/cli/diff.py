"""railui diff: differences between two designs, studies or campaigns."""

from __future__ import annotations

from typing import Any

import click

from railui.cli.invocation import Invocation, common_options
from railui.cli.tables import make_table


@click.command("diff")
@click.argument("a", metavar="A.yaml")
@click.argument("b", metavar="B.yaml")
@common_options
def command(a: str, b: str, call: Invocation) -> None:
    """List every value in which B.yaml differs from A.yaml, with units and defaults resolved."""
    from railui.api.files import diff

    rows = diff(a, b)
    cells = [(row["path"], _value(row, "a"), _value(row, "b"), _change(row["relative"])) for row in rows]
    call.show(make_table(("path", a, b, "change"), cells) if rows else "no difference")
    call.write_json(call.document("diff", {"differences": rows}, [a, b]))


def _value(row: dict[str, Any], key: str) -> str:
    from railui.io.number_format import format_quantity

    value, unit = row[key], row["unit"]
    if value is None:
        return "-"
    return format_quantity(value, unit) if isinstance(value, float) and unit else str(value)


def _change(relative: float | None) -> str:
    return "" if relative is None else f"{100 * relative:+.3g} %"
