"""railui import: runs and tracks from the files of test benches, track recording cars and railui recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli.invocation import Invocation, common_options, usage_error, usage_errors
from railui.cli.tables import format_cell, make_table

if TYPE_CHECKING:
    from railui.capture.processing.measured_run import MeasuredRun
    from railui.capture.processing.recording import Recording


@click.command("import")
@click.argument("file", metavar="FILE")
@click.option("--map", "map_file", metavar="map.yaml", help="Assignment of channels to sensors.")
@click.option("-o", "--out", metavar="RUN.csv.gz", help="File of the run, or of the track of a recording car.")
@click.option(
    "--draft", metavar="map.yaml", help="Write a draft of a map: every channel with the quantities it may be."
)
@click.option("--clock", metavar="NAME", help="Time or distance channel, where there is no map.")
@click.option("--rate", type=float, metavar="HZ", help="Sampling rate without a clock.")
@common_options
def command(
    file: str,
    map_file: str | None,
    out: str | None,
    draft: str | None,
    clock: str | None,
    rate: float | None,
    call: Invocation,
) -> None:
    """Convert FILE into a run with the map of its sensors; without -o list its channels.

    \b
    railui import bench.mf4                                     list its channels
    railui import bench.mf4 --draft map.yaml                    write a draft of a map
    railui import bench.mf4 --map map.yaml -o run_a.csv.gz      write the run
    railui import run_a.csv.gz -o run_a.mf4                     export: .mf4, .uff, .h5, .mat

    FILE: CSV of any kind (separator, decimal comma, encoding, units in the header), MDF (.mf4), universal file 58,
    HDF5, MATLAB, TDMS, MCAP, a directory of railui capture. Rows against distance (recording cars) become a track.
    The rail position is reconstructed where no channel contains it: docs/capture.md.
    """
    from railui.api.recordings import channel_rows
    from railui.capture.formats import read_recordings
    from railui.capture.processing.sensor_map import load_map

    sensor_map = load_map(map_file) if map_file is not None else None
    if sensor_map is not None:
        clock, rate = clock or sensor_map.clock, sensor_map.rate if rate is None else rate
    recordings = read_recordings(file, clock, rate)
    recording = max(recordings, key=lambda r: r.t.size)
    if len(recordings) > 1:
        others = ", ".join(str(r.sources[0].name) for r in recordings if r is not recording)
        call.info(
            f"{file} contains {len(recordings)} recordings with separate clocks: the longest is used, not {others}"
        )
    body: dict[str, Any] = {"channels": channel_rows(recording), "notes": recording.notes}
    if sensor_map is None:
        for note in recording.notes:
            call.info(f"note: {note}")
    if draft is not None:
        _write_draft(recording, draft, call)
    elif out is None:
        call.show(_channels_table(recording, body["channels"]))
    elif sensor_map is None:
        body |= _export(recording, Path(out), call)
    elif recording.abscissa == "s":
        body |= _import_track(recording, sensor_map, Path(out), call)
    else:
        body |= _import_run(recording, sensor_map, Path(out), call)
    call.write_json(call.document("import", body, [*recording.sources, *([map_file] if map_file else [])]))


def _channels_table(recording: Recording, channels: Sequence[Mapping[str, Any]]) -> Any:
    title = f"{recording.name}: {recording.t.size} rows, every {recording.interval:.6g} {_abscissa_unit(recording)}"
    rows = [
        (c["name"], c["unit"] or "?", c["values"], format_cell(c["mean"], 5), format_cell(c["sd"], 5)) for c in channels
    ]
    return make_table(("channel", "unit", "values", "mean", "standard deviation"), rows, title=title)


def _abscissa_unit(recording: Recording) -> str:
    return "m" if recording.abscissa == "s" else "s"


def _write_draft(recording: Recording, draft: str, call: Invocation) -> None:
    from railui.capture.processing.draft import draft_map
    from railui.io.atomic import write_text
    from railui.io.problems import join_names

    if Path(draft).exists():
        raise usage_error(f"{draft} exists and is not overwritten: give another name")
    write_text(draft, draft_map(recording))
    without = [name for name in recording.channels if not recording.units.get(name)]
    if without:
        call.info(f"without a unit: {join_names(without)}; add the key `unit:` to their sensors, such as `unit: m/s^2`")
    out = "TRACK.csv" if recording.abscissa == "s" else "RUN.csv.gz"
    call.info(f"wrote {draft}: complete it, then `railui import {recording.sources[0]} --map {draft} -o {out}`")


def _export(recording: Recording, out: Path, call: Invocation) -> dict[str, Any]:
    """Write the same series in another format."""
    from railui.capture.formats import write_recording
    from railui.io.problems import refuse_overwriting

    refuse_overwriting(out, recording.sources)
    with usage_errors():
        write_recording(out, recording)
    call.info(f"wrote {out}: {recording.t.size} rows, {len(recording.channels)} channels")
    return {"rows": recording.t.size}


def _import_track(recording: Recording, sensor_map: Any, out: Path, call: Invocation) -> dict[str, Any]:
    from railui.api.recordings import write_track

    written = write_track(recording, sensor_map, out)
    call.info(f"wrote {out}: a track of {written['rows']} points, every {recording.interval:.4g} m")
    for note in written["notes"]:
        call.info(f"note: {note}")
    return written


def _import_run(recording: Recording, sensor_map: Any, out: Path, call: Invocation) -> dict[str, Any]:
    from railui.api.recordings import check_run_file, write_run

    with usage_errors():
        check_run_file(out)
    run = write_run(recording, sensor_map, out)
    show_imported_run(call, str(out), run)
    return run.report()


def show_imported_run(call: Invocation, name: str, run: MeasuredRun) -> None:
    """Print the contents of a run, its notes and the accuracy of its rail position."""
    rows = f"{run.columns['t'].size} of {run.counts['rows']} rows, {run.counts['gaps']} gaps"
    call.info(f"{name}: {', '.join(run.columns)}; {rows}")
    for note in run.notes:
        call.info(f"note: {note}")
    quality = run.rail_quality
    if quality is None:
        return
    valid = "none" if quality.valid is None else f"{quality.valid[0]:.3g} to {quality.valid[1]:.3g} m"
    caption = (
        f"valid wavelengths: {valid}; filter {run.natural_frequency:.3g} Hz; "
        f"distance of the wheelsets by correlation: 2a {quality.lag:+.3f} m"
    )
    bands = []
    for (low, high, sd, difference), error in zip(quality.bands, quality.errors, strict=True):
        bands.append((f"{low:g} to {high:g}", f"{1e3 * sd:.3f}", f"{1e3 * difference:.3f}", f"{100 * error:.1f} %"))
    if any(quality.roll_share):
        caption += "; the error contains that of the roll, which no sensor measures, for a usual cross-level"
    columns = ("wavelengths [m]", "sd yw [mm]", "difference of both wheelsets [mm]", "approx. error of the mean")
    call.show(make_table(columns, bands, title="rail position", caption=caption))
