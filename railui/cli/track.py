"""railui track: synthetic tracks, and the spectrum of a track."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import click

from railui.cli.arguments import resolve_track_argument
from railui.cli.invocation import Invocation, common_options, usage_error
from railui.cli.tables import make_table

if TYPE_CHECKING:
    from railui.track.excitation import TrackSource

QUANTITIES: Final[tuple[Literal["yw", "phiw", "gauge"], ...]] = ("yw", "phiw", "gauge")


@click.command("track")
@click.argument("spec", nargs=-1, metavar="[SPEC]...")
@click.option("-o", "--output", metavar="TRACK.csv", help="File of the track; - for stdout.")
@click.option("--spectrum", metavar="RUN|TRACK", help="Analyse a track, or that of a run.")
@common_options
def command(spec: tuple[str, ...], output: str | None, spectrum: str | None, call: Invocation) -> None:
    """Write a synthetic track, or analyse the spectrum of a track.

    \b
    railui track erri_b176_low length=2000 seed=1 -o line.csv
    railui track --spectrum line.csv

    A SPEC is a name (erri_b176_low, erri_b176_high, fra_1 to fra_6, sncf_good, sncf_poor) and key=value
    pairs of length, seed, spacing, shortest, longest, scale. Spectra are one-sided, per rad/m.
    """
    if bool(spec) == bool(spectrum):
        raise usage_error("give either the SPEC of a track to write, or --spectrum and a file")
    if spec and output is None and call.json is None:
        raise usage_error("give -o TRACK.csv (- for stdout), or --json")
    if output == "-" and call.json == "-":
        raise usage_error("stdout can take the track or the JSON, not both")
    source = _read(spectrum) if spectrum else resolve_track_argument(" ".join(spec), call.seed, "SPEC")
    if source.file is not None and output is not None:
        raise usage_error("-o writes a synthetic track: give its SPEC")
    if output is not None:
        _write(source, output, call)
    if spectrum or call.json is not None:
        from railui.api.track import analyse_track

        body = analyse_track(source)
        if spectrum:
            call.show(_table(source, body))
        inputs = [source.file] if source.file is not None else []
        call.write_json(call.document("track", body, inputs, source.seed))
    elif output != "-":
        call.info(f"wrote {output}: {len(source.track)} points of {source.name}")


def _read(name: str) -> TrackSource:
    from railui.track.excitation import is_track_file, resolve_track

    is_file = is_track_file(name) or (len(name.split()) == 1 and "." in name)
    return resolve_track(Path(name)) if is_file else resolve_track_argument(name, None, "--spectrum")


def _write(source: TrackSource, output: str, call: Invocation) -> None:
    from railui.track.reader import save_track, track_text

    track = source.track
    line = (track.curvature, track.cant) if track.has_curves else (None, None)
    columns = (track.s, track.yw, track.phiw, track.gauge, track.conventions, *line)
    if output == "-":
        click.echo(track_text(*columns), nl=False)
    else:
        save_track(output, *columns)


def _table(source: TrackSource, body: dict[str, Any]) -> Any:
    nearest = body["nearest"]
    caption = f"nearest spectrum: {nearest['name']} times {nearest['factor']:.3g}" if nearest else "flat"
    rows = [
        (
            f"{band['from']:g} to {band['to']:g}",
            *(f"{1e3 * band[f'sd_{quantity}']:.3f}" for quantity in QUANTITIES),
        )
        for band in body["bands"]
    ]
    columns = ("wavelengths [m]", "sd yw [mm]", "sd phiw [mrad]", "sd gauge [mm]")
    return make_table(columns, rows, title=source.name, caption=caption)
