"""railui desk: the terminal user interface."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click


@click.command("desk")
@click.argument("file", metavar="[DESIGN or CAMPAIGN]", required=False)
@click.option("--plain", is_flag=True, help="Use letters and the terminal's own colours only.")
@click.pass_context
def command(ctx: click.Context, file: str | None, plain: bool) -> None:
    """Open the terminal user interface: results are updated as parameters change.

    \b
    railui desk designs/test_bogie.yaml
    railui desk designs/campaigns/worn_axle_box

    F1 shows help, ctrl+p lists every command, ctrl+q quits.
    """
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise click.UsageError("the desk needs a terminal; without one, use the other commands", ctx)
    if os.environ.get("TERM") == "dumb":
        raise click.UsageError("TERM=dumb: this terminal cannot draw; use another, or the other commands", ctx)
    from railui.desk.app import run

    ctx.exit(run(Path(file) if file else None, plain=plain))
