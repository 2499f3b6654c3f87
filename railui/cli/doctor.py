"""railui doctor: published values and the machine against this installation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from railui.cli import VIOLATED
from railui.cli.common import Invocation, cell, options


@click.command("doctor")
@click.option("--reference", type=click.Path(exists=True, file_okay=False), metavar="DIR",
              help="A directory with en15302/ and profiles/, which are not ours to ship.")  # fmt: skip
@options
@click.pass_context
def command(ctx: click.Context, reference: str | None, call: Invocation) -> None:
    """Check this installation against reference values, each with its source, and check the machine.

    Some values are published, others were derived independently for this check.
    Eigenvalues, critical speeds, curves, contact, spectra and weightings; whether one lane and sixteen, one
    thread and several agree to the last digit. Exit code 4 where a check fails.
    """
    from pathlib import Path

    from railui.doctor import doctor

    found = doctor(None if reference is None else Path(reference), call.jobs)
    call.show(_table(found))
    call.emit(call.document("doctor", found))
    ctx.exit(0 if found["ok"] else VIOLATED)


def _table(found: Mapping[str, Any]) -> Any:
    from rich.table import Table
    from rich.text import Text

    machine = found["machine"]
    title = f"SIMD {machine['simd']}, {machine['threads']} threads, Python {machine['python']}, {machine['platform']}"
    table = Table("", "check", "expected", "got", "source", title=title, title_justify="left")
    for check in found["checks"]:
        mark = "ok" if check["ok"] else Text("FAILS", "bold red")
        values = (cell(check[key], 7) for key in ("name", "expected", "got", "source"))
        table.add_row(mark, *values)
    failed = sum(not check["ok"] for check in found["checks"])
    counts = f"{len(found['checks'])} checks, {failed} fail, {found['seconds']:.1f} s"
    skipped = [f"skipped: {one['name']}, {one['reason']}" for one in found["skipped"]]
    table.caption = "\n".join([*skipped, counts])
    return table
