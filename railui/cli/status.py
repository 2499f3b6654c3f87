"""railui status: where a running or finished study stands."""

from __future__ import annotations

import click

from railui.cli.common import Invocation, options


@click.command("status")
@click.argument("directory", metavar="DIR")
@options
def command(directory: str, call: Invocation) -> None:
    """Tell where the search in DIR stands: running, interrupted or finished, and how long it will take."""
    from railui.execution.session import status

    found = status(directory)
    failures = ", ".join(f"{count} {reason}" for reason, count in found["failures"].items())
    lines = [
        f"{found['study']}: {found['state']}" + (f" by {found['held_by']}" if found["held_by"] else ""),
        f"{found['evaluations']} designs evaluated, {found['failed']} failed" + (f" ({failures})" if failures else ""),
        f"{found['rides']} rides stored" + ("" if found["state"] == "finished" else f"; {found['doing']}"),
    ]
    if found["state"] == "running" and found["eta_s"] is not None:
        lines.append(f"about {found['eta_s']:.0f} s to go")
    call.show("\n".join(lines))
    call.emit(call.document("status", found))
