"""railui loop: adjust, trace what the model lacks, add it, adjust again, report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli.common import Invocation, narrator, options, refuse

if TYPE_CHECKING:
    from railui.identification.loop import LoopResult

ROWS = 8
EFFECTS = dict.fromkeys(("effect", "none"), "effects found") | {"outside": "effects added, which are not the answer"}


@click.command("loop")
@click.argument("campaign", metavar="CAMPAIGN")
@click.option("-o", "--out", metavar="DIR", help="Where the results go; railui-loop beside the campaign by default.")
@click.option("--without", metavar="KIND,KIND", default="", help="Effects that the trace may not name.")
@options
def command(campaign: str, out: str | None, without: str, call: Invocation) -> None:
    """Calibrate the model of a CAMPAIGN (its directory or campaign.yaml) and identify an unmodelled effect.

    \b
    railui loop designs/campaigns/worn_axle_box
    railui loop campaign.yaml -o results --json - --seed 1

    The declared vehicle is adjusted to the runs of role adjust; what remains is traced to an effect of the
    catalogue; the effect is added and everything adjusted again; the error is that of the runs of role
    validate: no parameter of the vehicle is fitted to them, but they decide which effects are accepted, so they
    are no independent test. State the noise of the track columns: without it the verdict can change.
    Every verdict (none, effect, outside) ends with exit code 0.
    """
    from railui.campaign.campaign import load_campaign
    from railui.campaign.dataset import read_dataset
    from railui.campaign.directory import campaign_file
    from railui.documents.recognise import expect
    from railui.identification.loop import close_loop
    from railui.io.atomic import check_writable
    from railui.report.figures.drawing import load_beside
    from railui.report.loop.data import loop_report
    from railui.report.loop.files import ForeignFiles, check_directory, write_loop

    barred = barred_kinds(without)
    source = campaign_file(campaign)
    expect(source, "campaign")
    loaded = load_campaign(source)
    call.warn(loaded.warnings)
    directory = Path(out) if out is not None else source.parent / "railui-loop"
    try:
        check_directory(directory)
    except ForeignFiles as error:
        raise refuse(str(error)) from None
    check_writable(directory)
    load_beside()
    log: list[str] = []
    report = narrator(call, log)
    found = close_loop(read_dataset(loaded), without=barred, seed=call.seed or 0, jobs=call.jobs, report=report)
    data = loop_report(found)
    log.append(str(data["sentence"]))
    write_loop(found, data, directory, log)
    call.emit(data)  # before the table: its reader may leave
    show(call, found, data)
    call.say(f"written to {directory}: loop.json, adjusted.yaml, campaign.yaml, report.html, simulated channels")


def barred_kinds(text: str) -> list[str]:
    """The kinds of --without; a usage error names the nearest for one that is unknown."""
    from railui import core
    from railui.io.problems import nearest

    kinds = [k.strip() for k in text.split(",") if k.strip()]
    known = [str(r["kind"]) for r in core.catalogue()]
    for kind in kinds:
        if kind not in known:
            raise refuse(f"no effect {kind!r} in the catalogue, {nearest(kind, known)}")
    return kinds


def show(call: Invocation, found: LoopResult, data: dict[str, Any]) -> None:
    """The verdict, the errors per channel and the effects, for the reader."""
    from rich.table import Table

    from railui.cli.adjust import parameters_table, profiles_note
    from railui.report.loop.data import shapeless, unstated_track_noise

    call.show(f"\n{data['sentence']}\n")
    table = Table(title="NRMSE on the validation runs", title_justify="left")
    table.add_column("")
    channels = list(data["declared"]["channels"])
    for name in ("all", *channels):
        table.add_column(name, justify="right")
    for which in ("declared", "before", "after", "floor"):
        row = data[which]
        cells = [row["nrmse"], *(row["channels"].get(c) for c in channels)]
        table.add_row(which, *(("-" if v is None else f"{v:.3f}") for v in cells))
    call.show(table)
    for note in [*unstated_track_noise(found.measurement), *shapeless(found)]:
        call.show(f"{note}\n")
    if data["profiles"]:
        contact = [path for path in data["parameters"] if path.startswith("contact.")]
        call.show(parameters_table(data, contact))
        call.show(profiles_note(data["profiles"]))
    if data["effects"]:
        call.show(effects_table(data))
    elif found.outside is None:
        call.show(smallest_table(data))


def effects_table(data: dict[str, Any]) -> Any:
    """The effects that were added, with their numbers; beside an `outside` they are not the answer."""
    from rich.table import Table

    from railui.io.number_format import display
    from railui.report.loop.phases import phase_of

    table = Table(title=EFFECTS[data["verdict"]], title_justify="left")
    for name in ("kind", "at", "wheelset", "parameter", "value", "standard deviation"):
        table.add_column(name)
    for effect in data["effects"]:
        where = "both" if effect["wheelset"] is None else str(effect["wheelset"])
        phases = [(f"phase, {phase_of(p)}", p) for p in effect["phases"]]
        for key, p in [*effect["parameters"].items(), *phases]:
            sd = "-" if p["sd"] is None else display(p["sd"], p["unit"])
            table.add_row(effect["kind"], effect["at"], where, key, display(p["value"], p["unit"]), sd)
    return table


def smallest_table(data: dict[str, Any]) -> Any:
    """The minimum detectable effects of this campaign."""
    from rich.table import Table

    from railui.io.number_format import display

    table = Table(title="minimum detectable effects (nominal power 90 %)", title_justify="left")
    for name in ("kind", "at", "smallest"):
        table.add_column(name)
    rows = [r for r in data["detectable"] if r["wheelset"] is None and r["value"] is not None]
    wanted = ("free_play", "dry_friction", "creep_saturation", "spring", "hysteresis", "flange_contact")
    for row in [r for k in wanted for r in rows if r["kind"] == k][: 2 * ROWS]:
        table.add_row(row["kind"], row["at"], f"{row['parameter']} {display(row['value'], row['unit'])}")
    return table
