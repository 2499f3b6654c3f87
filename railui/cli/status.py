"""railui status: state of a running or finished optimisation."""

from __future__ import annotations

import click

from railui.cli.invocation import Invocation, common_options


@click.command("status")
@click.argument("directory", metavar="DIR")
@common_options
def command(directory: str, call: Invocation) -> None:
    """Report the state of the optimisation in DIR: running, interrupted or finished, and the time that remains."""
    from railui import status

    state = status(directory)
    failures = ", ".join(f"{count} {reason}" for reason, count in state["failures"].items())
    lines = [
        f"{state['study']}: {state['state']}" + (f" by {state['held_by']}" if state["held_by"] else ""),
        f"{state['evaluations']} designs evaluated, {state['failed']} failed" + (f" ({failures})" if failures else ""),
        f"{state['rides']} simulations stored" + ("" if state["state"] == "finished" else f"; {state['doing']}"),
    ]
    if state["state"] == "running" and state["eta_s"] is not None:
        lines.append(f"about {state['eta_s']:.0f} s remaining")
    call.show("\n".join(lines))
    call.write_json(call.document("status", state))
