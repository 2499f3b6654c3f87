"""railui track: synthetic tracks, and what a track contains."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from railui.cli.common import Invocation, lay_track, options, refuse

if TYPE_CHECKING:
    from railui.track.excitation import TrackSource


@click.command("track")
@click.argument("spec", nargs=-1, metavar="[SPEC]...")
@click.option("-o", "--output", metavar="TRACK.csv", help="Where the track is written; - for stdout.")
@click.option("--spectrum", metavar="RUN|TRACK", help="Tell what a track, or that of a run, contains.")
@options
def command(spec: tuple[str, ...], output: str | None, spectrum: str | None, call: Invocation) -> None:
    """Write a synthetic track, or tell the spectrum of one.

    \b
    railui track erri_b176_low length=2000 seed=1 -o line.csv
    railui track --spectrum line.csv

    A SPEC is a name (erri_b176_low, erri_b176_high, fra_1 to fra_6, sncf_good, sncf_poor) and key=value
    pairs of length, seed, spacing, shortest, longest, scale. Spectra are one-sided, per rad/m.
    """
    if bool(spec) == bool(spectrum):
        raise refuse("give either the SPEC of a track to write, or --spectrum and a file")
    if spec and output is None and call.json is None:
        raise refuse("give -o TRACK.csv (- for stdout), or --json")
    if output == "-" and call.json == "-":
        raise refuse("stdout can take the track or the JSON, not both")
    laid = _read(spectrum) if spectrum else lay_track(" ".join(spec), call.seed, "SPEC")
    if laid.file is not None and output is not None:
        raise refuse("-o writes a synthetic track: give its SPEC")
    if output is not None:
        _write(laid, output, call)
    if spectrum or call.json is not None:
        body = contents(laid)
        if spectrum:
            call.show(_table(laid, body))
        inputs = [laid.file] if laid.file is not None else []
        call.emit(call.document("track", body, inputs, laid.seed))
    elif output != "-":
        call.say(f"{len(laid.track)} places of {laid.name} written to {output}")


def _read(name: str) -> TrackSource:
    from pathlib import Path

    from railui.track.excitation import is_track_file, resolve_track

    file = is_track_file(name) or (len(name.split()) == 1 and "." in name)
    return resolve_track(Path(name)) if file else lay_track(name, None, "--spectrum")


def _write(laid: TrackSource, output: str, call: Invocation) -> None:
    from railui.track.reader import save_track, track_text

    track = laid.track
    columns = (track.s, track.yw, track.phiw, track.gauge, track.conventions)
    if output == "-":
        click.echo(track_text(*columns), nl=False)
    else:
        save_track(output, *columns)


def contents(laid: TrackSource) -> dict[str, Any]:
    """What a track contains: bands, one-sided densities per rad/m, the nearest known spectrum."""
    from railui.track import BANDS, band_sd, nearest_spectrum, psd

    track = laid.track
    sds = {quantity: band_sd(track, quantity=quantity) for quantity in ("yw", "phiw", "gauge")}
    bands = [
        {"from": low, "to": high, **{f"sd_{name}": float(sd[i]) for name, sd in sds.items()}}
        for i, (low, high) in enumerate(BANDS)
    ]
    nearest, spectrum = nearest_spectrum(track), psd(track)
    notes = list(laid.notes)
    if track.length < 3 * BANDS[-1][1]:
        notes.append(f"the track is {track.length:.4g} m long: its waves above {track.length / 3:.3g} m are few")
    return {
        "track": laid.name,
        "length": track.length,
        "spacing": track.spacing,
        "samples": len(track),
        "bands": bands,
        "nearest": None if nearest is None else {"name": nearest.name, "factor": nearest.factor},
        "spectrum": {name: getattr(spectrum, name) for name in spectrum._fields},
        "conventions": list(track.conventions),
        "notes": [*notes, "spectrum: one-sided, per rad/m"],
    }


def _table(laid: TrackSource, body: dict[str, Any]) -> Any:
    from rich.table import Table

    nearest = body["nearest"]
    told = f"nearest: {nearest['name']} times {nearest['factor']:.3g}" if nearest else "flat"
    columns = ("wavelengths [m]", "sd yw [mm]", "sd phiw [mrad]", "sd gauge [mm]")
    table = Table(*columns, title=laid.name, caption=told)
    for band in body["bands"]:
        values = (f"{1e3 * band[key]:.3f}" for key in ("sd_yw", "sd_phiw", "sd_gauge"))
        table.add_row(f"{band['from']:g} to {band['to']:g}", *values)
    return table
