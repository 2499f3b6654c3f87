"""railui check: every problem of any of our files."""

from __future__ import annotations

import click

from railui.cli import WRONG
from railui.cli.common import Invocation, options


@click.command("check")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@options
@click.pass_context
def command(ctx: click.Context, files: tuple[str, ...], call: Invocation) -> None:
    """Tell every problem of any of our files, as file:line:column: key: what, remedy.

    A campaign is checked with its runs. Exit code 2 where there is an error; warnings alone are none.
    """
    from railui.documents.check import check
    from railui.track import parse_spec

    problems = check(files, check_track=parse_spec)
    for problem in problems:
        call.show(str(problem))
    errors = sum(problem.severity == "error" for problem in problems)
    call.emit(call.document("check", {"problems": [p.as_dict() for p in problems]}, files))
    told = [f"{n} {word}{'' if n == 1 else 's'}" for n, word in _counted(errors, len(problems), len(files))]
    call.say(", ".join(told[:2]) + f" in {told[2]}" if problems else f"{told[2]} without a problem")
    ctx.exit(WRONG if errors else 0)


def _counted(errors: int, problems: int, files: int) -> list[tuple[int, str]]:
    return [(errors, "error"), (problems - errors, "warning"), (files, "file")]
