"""railui capture campaign: recordings to a campaign for railui loop."""

from __future__ import annotations

import click

from railui.cli.import_ import show_imported_run
from railui.cli.invocation import Invocation, common_options


@click.command("campaign")
@click.option("--map", "map_file", required=True, metavar="map.yaml", help="Sensor map: which channel is which sensor.")
@click.option(
    "--adjust", multiple=True, required=True, metavar="DIR", help="Recording for estimation; may be repeated."
)
@click.option(
    "--validate", multiple=True, required=True, metavar="DIR", help="Recording for validation; may be repeated."
)
@click.option("--name", metavar="NAME", help="Name of the campaign; that of its directory by default.")
@click.option("-o", "--out", required=True, metavar="DIR", help="Directory of campaign.yaml and its runs.")
@common_options
def command(
    map_file: str, adjust: tuple[str, ...], validate: tuple[str, ...], name: str | None, out: str, call: Invocation
) -> None:
    """Map recordings, reconstruct the rails, and write a campaign: then `railui loop DIR`.

    \b
    railui capture campaign --map map.yaml --adjust monday --validate tuesday -o campaign
    railui loop campaign

    A recording is a directory of railui capture, or any file that railui import reads. The map names the vehicle.
    """
    from railui.api.recorded_campaign import write_recorded_campaign
    from railui.documents.check import check

    campaign = write_recorded_campaign(map_file, {"adjust": adjust, "validate": validate}, out, name=name)
    for run in campaign.runs:
        show_imported_run(call, f"{run.source} ({run.role}, {run.run.duration:.1f} s)", run.run)
    for note in campaign.notes:
        call.info(note)
    call.warn(check([campaign.path]))
    call.write_json(call.document("capture_campaign", campaign.report(), [map_file, campaign.path]))
    call.info(f"wrote {campaign.path}: railui loop {out}")
