"""railui check: validation of input files."""

from __future__ import annotations

import click

from railui.cli import EXIT_USAGE
from railui.cli.invocation import Invocation, common_options
from railui.cli.tables import format_count


@click.command("check")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@common_options
@click.pass_context
def command(ctx: click.Context, files: tuple[str, ...], call: Invocation) -> None:
    """Validate input files and list all errors and warnings as file:line:column: key: problem, remedy.

    The runs of a campaign are validated with it. Exit code 2 where there is an error; warnings do not count.
    """
    from railui.capture.processing.sensor_map import load_map
    from railui.documents.check import check
    from railui.track import parse_spec

    problems = check(files, check_track=parse_spec, load_map=load_map)
    for problem in problems:
        call.show(str(problem))
    errors = sum(problem.severity == "error" for problem in problems)
    call.write_json(call.document("check", {"problems": [p.as_dict() for p in problems]}, files))
    checked = format_count(len(files), "file")
    if problems:
        call.info(f"{format_count(errors, 'error')}, {format_count(len(problems) - errors, 'warning')} in {checked}")
    else:
        call.info(f"{checked} without a problem")
    ctx.exit(EXIT_USAGE if errors else 0)
