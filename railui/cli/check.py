"""railui check: validation of input files."""

from __future__ import annotations

from pathlib import Path

import click

from railui.cli import EXIT_USAGE
from railui.cli.arguments import quantity_option
from railui.cli.invocation import Invocation, StatusLine, common_options, usage_error
from railui.cli.quantities import parse_drawing_path
from railui.cli.tables import format_count


@click.command("check")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@quantity_option(
    "--draw",
    parse_drawing_path,
    metavar="FILE.svg",
    help="Draw the vehicle of a design or campaign from above, with its suspension, effects and sensors.",
)
@common_options
@click.pass_context
def command(ctx: click.Context, files: tuple[str, ...], draw: str | None, call: Invocation) -> None:
    """Validate input files and list all errors and warnings as file:line:column: key: problem, remedy.

    The runs of a campaign or of a fleet are validated with it. Exit code 2 where there is an error; warnings do not
    count.

    \b
    railui check designs/manchester_coach.yaml --draw coach.svg
    """
    from railui.api.files import check

    if draw is not None and len(files) > 1:
        raise usage_error("--draw draws one design or campaign: name one file")
    problems = check(*files, progress=StatusLine(call))
    for problem in problems:
        call.show(str(problem))
    errors = sum(problem.severity == "error" for problem in problems)
    call.write_json(call.document("check", {"problems": [p.as_dict() for p in problems]}, files))
    checked = format_count(len(files), "file")
    if problems:
        call.info(f"{format_count(errors, 'error')}, {format_count(len(problems) - errors, 'warning')} in {checked}")
    else:
        call.info(f"{checked} without a problem")
    if draw is not None and not errors:
        _draw(files[0], draw)
        call.info(f"wrote {draw}")
    ctx.exit(EXIT_USAGE if errors else 0)


def _draw(file: str, target: str) -> None:
    """Write the schematic of a design, or of a campaign's vehicle with its sensors."""
    from railui.campaign.campaign import load_campaign
    from railui.campaign.dataset import load_campaign_run
    from railui.documents.recognise import recognise
    from railui.io.atomic import write_text
    from railui.report.schematic.subjects import schematic_of_campaign, schematic_of_design
    from railui.vehicle.design_reader import load_design

    kind = recognise(file)
    if kind not in ("design", "campaign"):
        raise usage_error(f"--draw draws a design or a campaign, {file} is a {kind}")
    if kind == "design":
        svg = schematic_of_design(load_design(Path(file)))
    else:
        campaign = load_campaign(file)
        runs = [load_campaign_run(campaign, entry) for entry in campaign.runs]
        svg = schematic_of_campaign(campaign, [name for run in runs for name in run.columns])
    write_text(target, svg)
