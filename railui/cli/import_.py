"""railui import: runs and tracks from the files of test benches, recording cars and our own recordings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli.common import Invocation, options, refuse

if TYPE_CHECKING:
    from railui.capture.processing.measured_run import MeasuredRun
    from railui.capture.processing.recording import Recording


@click.command("import")
@click.argument("file", metavar="FILE")
@click.option("--map", "map_file", metavar="map.yaml", help="Which channel is which sensor.")
@click.option("-o", "--out", metavar="RUN.csv.gz", help="Where the run (of a recording car: the track) goes.")
@click.option("--draft", metavar="map.yaml", help="Write a map to begin with: every channel and what it may be.")
@click.option("--clock", metavar="NAME", help="The channel of time, where there is no map.")
@click.option("--rate", type=click.FloatRange(0, min_open=True), metavar="HZ", help="Where there is no time.")
@options
def command(
    file: str, map_file: str | None, out: str | None, draft: str | None, clock: str | None, rate: float | None,
    call: Invocation,
) -> None:  # fmt: skip
    """Turn FILE into a run with the map of its sensors; without -o list its channels.

    \b
    railui import bench.mf4                                     what is in it
    railui import bench.mf4 --draft map.yaml                    a map to begin with
    railui import bench.mf4 --map map.yaml -o run_a.csv.gz      the run
    railui import run_a.csv.gz -o run_a.mf4                     and back: .mf4, .uff, .h5, .mat

    FILE: CSV of any kind (separator, decimal comma, encoding, units in the header), MDF (.mf4), universal file 58,
    HDF5, MATLAB, a directory that railui capture wrote. Rows against distance (recording cars) become a track.
    The rail position is reconstructed where no channel tells it: docs/capture.md.
    """
    from railui.capture.formats import read_recordings
    from railui.capture.processing.sensor_map import load_map

    mapped = load_map(map_file) if map_file is not None else None
    if mapped is not None:
        clock, rate = clock or mapped.clock, rate or mapped.rate
    recordings = read_recordings(file, clock, rate)
    recording = max(recordings, key=lambda r: r.t.size)
    if len(recordings) > 1:
        call.say(f"{file} holds {len(recordings)} recordings on clocks of their own: the longest is taken")
    body: dict[str, Any] = {"channels": _channels(recording)}
    if draft is not None:
        _draft(recording, draft, call)
    elif out is None:
        call.show(_listed(recording))
    elif mapped is None:
        body |= _exported(recording, Path(out), call)
    elif recording.against == "s":
        body |= _track(recording, mapped, Path(out), call)
    else:
        body |= _run(recording, mapped, Path(out), call)
    call.emit(call.document("import", body, [*recording.sources, *([map_file] if map_file else [])]))


def _channels(recording: Recording) -> list[dict[str, Any]]:
    import numpy as np

    found = []
    for name, x in recording.channels.items():
        known = x[np.isfinite(x)]
        mean, sd = (float(known.mean()), float(known.std())) if known.size else (None, None)
        found.append({"name": name, "unit": recording.units.get(name), "values": known.size, "mean": mean, "sd": sd})
    return found


def _listed(recording: Recording) -> Any:
    from rich.table import Table

    unit = "m" if recording.against == "s" else "s"
    title = f"{recording.name}: {recording.t.size} rows, every {recording.interval:.6g} {unit}"
    table = Table("channel", "unit", "values", "mean", "standard deviation", title=title, title_justify="left")
    for c in _channels(recording):
        numbers = ("-" if c[key] is None else f"{c[key]:.5g}" for key in ("mean", "sd"))
        table.add_row(c["name"], c["unit"] or "?", str(c["values"]), *numbers)
    return table


def _draft(recording: Recording, draft: str, call: Invocation) -> None:
    from railui.capture.processing.draft import draft_map
    from railui.io.atomic import write_text

    if Path(draft).exists():
        raise refuse(f"{draft} is there already and stays as it is: give another name")
    write_text(draft, draft_map(recording))
    call.say(f"wrote {draft}: complete it, then `railui import {recording.sources[0]} --map {draft} -o RUN.csv.gz`")


def _exported(recording: Recording, out: Path, call: Invocation) -> dict[str, Any]:
    """The same series in another format."""
    from railui.capture.formats import ending, write_recording
    from railui.io.table import write_table

    if ending(out) == ".csv":
        columns = {recording.against: recording.t, **recording.channels}
        units = {recording.against: "m" if recording.against == "s" else "s"} | {
            name: unit or "1" for name, unit in recording.units.items() if name != recording.against
        }
        write_table(out, {f"{name} [{units[name]}]": x for name, x in columns.items()}, digits=12)
    else:
        try:
            write_recording(out, recording)
        except ValueError as error:
            raise refuse(str(error)) from None
    call.say(f"wrote {out}: {recording.t.size} rows, {len(recording.channels)} channels")
    return {"rows": recording.t.size}


def _track(recording: Recording, mapped: Any, out: Path, call: Invocation) -> dict[str, Any]:
    from railui.capture.processing.measured_run import track_of
    from railui.track.reader import load_track, save_track

    columns = track_of(recording, mapped)
    about = (f"measured: {recording.name}", "lateral deviation as the recording car filtered it")
    save_track(out, columns["s"], columns["yw"], columns.get("phiw"), columns.get("gauge"), about)
    try:
        load_track(out)
    except ValueError:
        out.unlink()
        raise
    call.say(f"wrote {out}: a track of {columns['s'].size} places, every {recording.interval:.4g} m")
    return {"columns": list(columns), "rows": columns["s"].size}


def _run(recording: Recording, mapped: Any, out: Path, call: Invocation) -> dict[str, Any]:
    from railui.capture.processing.measured_run import measured_run, save_run

    if not out.name.lower().endswith((".csv", ".csv.gz")):
        raise refuse(f"a run is a CSV: write -o {out.stem}.csv.gz")
    run = measured_run(recording, mapped)
    save_run(out, run, (f"from {recording.name} by {mapped.source.name}", *run.notes))
    show_run(call, str(out), run)
    return run.report()


def show_run(call: Invocation, name: str, run: MeasuredRun) -> None:
    """What a run holds and how good its track is."""
    rows = f"{run.columns['t'].size} of {run.counts['rows']} rows, {run.counts['gaps']} gaps"
    call.say(f"{name}: {', '.join(run.columns)}; {rows}")
    for note in run.notes:
        call.say(f"note: {note}")
    if run.quality is None:
        return
    from rich.table import Table

    q = run.quality
    valid = "none" if q.valid is None else f"{q.valid[0]:.3g} to {q.valid[1]:.3g} m"
    told = f"valid {valid}; filter {run.natural:.3g} Hz; the trailing wheelset {q.lag:+.3f} m beside 2a"
    columns = ("wavelengths [m]", "sd yw [mm]", "difference of both wheelsets [mm]", "error of their mean, about")
    table = Table(*columns)
    table.title, table.caption, table.title_justify, table.caption_justify = "rail position", told, "left", "left"
    for low, high, sd, difference in q.bands:
        share = 100 * 0.5 * difference / sd if sd else 0.0
        table.add_row(f"{low:g} to {high:g}", f"{1e3 * sd:.3f}", f"{1e3 * difference:.3f}", f"{share:.1f} %")
    call.show(table)
