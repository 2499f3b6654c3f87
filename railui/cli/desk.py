"""railui desk: the terminal user interface, in the terminal or in a browser."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

from railui.io.extras import install_extra

DEFAULT_PORT = 8137


@click.command("desk")
@click.argument("file", metavar="[DESIGN or CAMPAIGN]", required=False)
@click.option("--plain", is_flag=True, help="Use letters and the terminal's own colours only.")
@click.option("--serve", is_flag=True, help="Show the desk in browsers, at an address with a token.")
@click.option("--host", default="127.0.0.1", show_default=True, help="With --serve: address to listen on.")
@click.option("--port", default=DEFAULT_PORT, show_default=True, help="With --serve: port; 0: any free one.")
@click.pass_context
def command(ctx: click.Context, file: str | None, plain: bool, serve: bool, host: str, port: int) -> None:
    """Open the terminal user interface: results are updated as parameters change.

    \b
    railui desk designs/test_bogie.yaml
    railui desk designs/campaigns/worn_axle_box
    railui desk --serve designs/test_bogie.yaml

    F1 shows help, ctrl+p lists every command, ctrl+q quits.
    """
    if serve:
        _serve(ctx, file, plain, host, port)
    is_served = "TEXTUAL_DRIVER" in os.environ  # the server is the terminal
    if not is_served and not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise click.UsageError("the desk needs a terminal; without one, use --serve or the other commands", ctx)
    if not is_served and os.environ.get("TERM") == "dumb":
        raise click.UsageError("TERM=dumb: this terminal cannot draw; use another, or the other commands", ctx)
    from railui.desk.app import run

    ctx.exit(run(Path(file) if file else None, plain=plain))


def _serve(ctx: click.Context, file: str | None, plain: bool, host: str, port: int) -> None:
    try:
        from railui.desk.serving import serve, served_words
    except ImportError as error:
        remedy = install_extra("serve")
        raise click.UsageError(f"--serve needs textual-serve ({error}): {remedy}", ctx) from error
    if file is not None and not Path(file).exists():
        raise click.UsageError(f"{file} does not exist", ctx)
    try:
        ctx.exit(serve(served_words(file, plain), host, port))
    except (OSError, ValueError) as error:
        raise click.ClickException(f"cannot serve the desk on {host}:{port}: {error}") from error
