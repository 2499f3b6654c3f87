"""railui capture campaign: recordings to a campaign for railui loop."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli.import_ import show_imported_run
from railui.cli.invocation import Invocation, common_options, usage_error

if TYPE_CHECKING:
    from railui.capture.processing.campaign_files import CampaignRun
    from railui.capture.processing.sensor_map import SensorMap


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
    from railui.capture.processing.campaign_files import align_runs, write_campaign
    from railui.capture.processing.sensor_map import load_map
    from railui.documents.check import check

    directory = Path(out)
    if (directory / "campaign.yaml").exists():
        raise usage_error(f"{directory} holds a campaign, which is not overwritten: give another -o DIR")
    sensor_map = load_map(map_file)
    if sensor_map.design is None or sensor_map.design.source is None:
        raise usage_error(f"{map_file} names no vehicle: add `vehicle: DESIGN.yaml`, the nominal model")
    runs = _build_runs(sensor_map, {"adjust": adjust, "validate": validate})
    _refuse_overlap(runs)
    runs, notes = align_runs(runs)
    path = write_campaign(directory, name or directory.resolve().name, Path(sensor_map.design.source), runs)
    for run in runs:
        show_imported_run(call, f"{run.source} ({run.role}, {run.run.duration:.1f} s)", run.run)
    for note in notes:
        call.info(note)
    call.warn(check([path]))
    reports: list[dict[str, Any]] = [{"role": r.role, "source": r.source, **r.run.report()} for r in runs]
    body = {"campaign": path, "runs": reports, "notes": notes}
    call.write_json(call.document("capture_campaign", body, [map_file, path]))
    call.info(f"wrote {path}: railui loop {directory}")


def _build_runs(sensor_map: SensorMap, sources: dict[str, tuple[str, ...]]) -> list[CampaignRun]:
    """Build the runs of all recordings, by role."""
    from railui.capture.formats import read_recordings
    from railui.capture.processing.campaign_files import CampaignRun
    from railui.capture.processing.run_builder import build_measured_run
    from railui.capture.simulator.logger import DEMO_DEVICE

    return [
        CampaignRun(
            role,
            recording.name,
            build_measured_run(recording, sensor_map),
            is_simulated=recording.device == DEMO_DEVICE,
        )
        for role, paths in sources.items()
        for path in paths
        for recording in read_recordings(path, sensor_map.clock, sensor_map.rate)
    ]


def _refuse_overlap(runs: Sequence[CampaignRun]) -> None:
    """Refuse a recording that serves estimation and validation."""
    from itertools import combinations

    from railui.runs.overlap import MAX_SHARED_SHARE, shared_share

    for first, second in combinations(runs, 2):
        if first.role != second.role and shared_share(first.run.columns, second.run.columns) > MAX_SHARED_SHARE:
            same = f"{first.source} (--{first.role}) and {second.source} (--{second.role}) share samples"
            raise usage_error(f"{same}: a model is validated on a recording that no fit has used, give another one")
