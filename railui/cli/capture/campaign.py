"""railui capture campaign: recordings to a campaign that railui loop reads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from railui.cli.common import Invocation, options, refuse
from railui.cli.import_ import show_run


@click.command("campaign")
@click.option("--map", "map_file", required=True, metavar="map.yaml", help="Which channel is which sensor.")
@click.option(
    "--adjust", multiple=True, required=True, metavar="DIR", help="A recording to adjust on; may be repeated."
)
@click.option(
    "--validate", multiple=True, required=True, metavar="DIR", help="A recording to judge on; may be repeated."
)
@click.option("--name", metavar="NAME", help="Of the campaign; that of its directory by default.")
@click.option("-o", "--out", required=True, metavar="DIR", help="Where campaign.yaml and its runs go.")
@options
def command(
    map_file: str, adjust: tuple[str, ...], validate: tuple[str, ...], name: str | None, out: str, call: Invocation
) -> None:
    """Map recordings, reconstruct the rails, and write a campaign: then `railui loop DIR`.

    \b
    railui capture campaign --map map.yaml --adjust monday --validate tuesday -o campaign
    railui loop campaign

    A recording is a directory of railui capture, or any file that railui import reads. The map names the vehicle.
    """
    from railui.capture.formats import read_recordings
    from railui.capture.processing.campaign_files import Taken, duration, on_one_line, write_campaign
    from railui.capture.processing.measured_run import measured_run
    from railui.capture.processing.sensor_map import load_map
    from railui.documents.check import check

    directory = Path(out)
    if (directory / "campaign.yaml").exists():
        raise refuse(f"{directory} holds a campaign already and it stays as it is: give another -o DIR")
    mapped = load_map(map_file)
    if mapped.design is None or mapped.design.source is None:
        raise refuse(f"{map_file} names no vehicle: add `vehicle: DESIGN.yaml`, the one that is declared")
    taken: list[Taken] = []
    for role, sources in (("adjust", adjust), ("validate", validate)):
        for source in sources:
            for recording in read_recordings(source, mapped.clock, mapped.rate):
                taken.append(Taken(role, recording.name, measured_run(recording, mapped)))
    taken, notes = on_one_line(taken)
    path = write_campaign(directory, name or directory.resolve().name, Path(mapped.design.source), taken)
    for one in taken:
        show_run(call, f"{one.source} ({one.role}, {duration(one.run):.1f} s)", one.run)
    for note in notes:
        call.say(note)
    problems = check([path])
    call.warn(problems)
    runs: list[dict[str, Any]] = [{"role": t.role, "source": t.source, **t.run.report()} for t in taken]
    call.emit(call.document("capture_campaign", {"campaign": path, "runs": runs, "notes": notes}, [map_file, path]))
    call.say(f"wrote {path}: railui loop {directory}")
