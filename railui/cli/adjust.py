"""railui adjust: adjust a model's parameters to a measured campaign."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from railui.cli.common import Invocation, narrator, options, refuse
from railui.cli.quantities import reading
from railui.cli.quantities import stretch as stretch_of_track

if TYPE_CHECKING:
    from railui.identification.loop import LoopResult

SCATTER = 4.0  # chi2 of a parameter's stretches from which it is shown
LEAST = 0.01  # and of its value, by which it must differ


@click.command("adjust")
@click.argument("campaign", metavar="CAMPAIGN")
@click.option("--coefficients", is_flag=True, help="Free the 16 coefficients of the wheelset equations as well.")
@click.option(
    "--stretch",
    callback=reading(stretch_of_track),
    metavar="LENGTH",
    help='Parameters per stretch of track, such as 500 or "0.5 km".',
)
@click.option(
    "--method",
    type=click.Choice(["least-squares", "two-parallel-models"]),
    default="least-squares",
    show_default=True,
    help="All parameters at once, or Broersen's one difference at a time.",
)
@click.option("--profile", "profiled", metavar="PATH,PATH", help='Profile likelihood of these parameters; "all".')
@options
def command(
    campaign: str, coefficients: bool, stretch: float | None, method: str, profiled: str | None, call: Invocation
) -> None:
    """Adjust the declared vehicle of a measured CAMPAIGN, without looking for effects.

    \b
    railui adjust designs/campaigns/worn_axle_box --json -
    railui adjust campaign.yaml --coefficients --stretch 500
    railui adjust campaign.yaml --profile contact.leading.conicity,vehicle.secondary.yaw_damping
    railui adjust campaign.yaml --method two-parallel-models

    Output-error least squares over all channels of the runs of role adjust; the error stands for the runs of
    role validate.
    """
    from railui.campaign.campaign import load_campaign
    from railui.campaign.dataset import read_dataset
    from railui.documents.recognise import expect
    from railui.identification.loop import calibrate_only
    from railui.report.loop.data import loop_report

    expect(campaign, "campaign")
    loaded = load_campaign(campaign)
    call.warn(loaded.warnings)
    paths = profiled_paths(profiled, loaded.adjust)
    if loaded.design.kind != "bogie" and (coefficients or stretch is not None):
        raise refuse("--coefficients and --stretch are for vehicles on a track, this campaign is of a rig")
    report = narrator(call, [])
    found = calibrate_only(read_dataset(loaded), method=method, seed=call.seed or 0, jobs=call.jobs, report=report)
    data = loop_report(found)
    data = data | {"schema": "railui.adjust/1", "method": method}
    for key in ("verdict", "sentence", "ranking", "traces", "detectable", "classes", "outside"):
        data.pop(key)
    data |= further(found, coefficients, stretch, paths, method, call, report)
    call.emit(data)  # before the table: its reader may leave
    show(call, found, data)


def profiled_paths(text: str | None, adjusted: tuple[str, ...]) -> list[str]:
    """The parameters of --profile; a usage error names the nearest for one that is not adjusted."""
    from railui.io.problems import nearest

    if text is None:
        return []
    paths = list(adjusted) if text.strip() == "all" else [p.strip() for p in text.split(",") if p.strip()]
    for path in paths:
        if path not in adjusted:
            raise refuse(f"{path!r} is not adjusted in this campaign, {nearest(path, list(adjusted))}")
    return paths


def further(
    found: LoopResult,
    coefficients: bool,
    length: float | None,
    paths: list[str],
    method: str,
    call: Invocation,
    report: Any,
) -> dict[str, Any]:
    """What was asked for beyond the adjustment, as data."""
    from railui.identification.estimation import identifiability
    from railui.identification.estimation.parallel_models import correlations
    from railui.identification.unmodelled.coefficients import coefficients as freed
    from railui.io.atomic import finite
    from railui.report.loop import identifiability as told

    data: dict[str, Any] = {}
    if method == "two-parallel-models":
        data["correlations"] = told.correlation_rows(correlations(found.before, jobs=call.jobs))
    if coefficients:
        data["coefficients"] = told.coefficient_rows(freed(found.before))
    if length is not None:
        data["stretches"] = told.stretch_rows(identifiability.per_stretch(found.before, length))
    if paths:
        data["profile"] = told.profile_rows(
            identifiability.profile_likelihoods(found.before, paths, jobs=call.jobs, report=report)
        )
    return dict(finite(data))


def show(call: Invocation, found: LoopResult, data: dict[str, Any]) -> None:
    """Parameters before and after, the error, and what was asked for beside."""
    from railui.io.number_format import display
    from railui.report.loop.data import unstated_track_noise

    call.show(parameters_table(data, list(data["parameters"])))
    if data["profiles"]:
        call.show(profiles_note(data["profiles"]))
    for sentence in data["identifiability"]["words"]:
        call.show(sentence)
    error, floor = data["after"]["nrmse"], data["floor"]["nrmse"]
    declared = data["declared"]["nrmse"]
    told = ["-" if x is None else f"{x:.3f}" for x in (declared, error, floor)]
    call.show(f"NRMSE on the validation runs: declared {told[0]}, adjusted {told[1]}, noise floor {told[2]}")
    for note in unstated_track_noise(found.measurement):
        call.show(note)
    show_coefficients(call, data.get("coefficients"))
    show_stretches(call, data.get("stretches"))
    for path, p in data.get("profile", {}).items():
        unit = data["parameters"][path]["unit"]
        ends = ["open" if p[k] is None else display(p[k], unit) for k in ("low", "high")]
        call.show(f"profile of {path}: 90 % from {ends[0]} to {ends[1]}")
    call.say(f"{found.before.simulations} simulations")


def parameters_table(data: dict[str, Any], paths: list[str]) -> Any:
    """Parameters before and after, beside what the profiles of the design give where it names a pair."""
    from rich.table import Table

    from railui.io.number_format import display

    profiles = data["profiles"]
    table = Table(title="adjusted parameters", title_justify="left")
    for name in ("path", "declared", *(["profiles"] if profiles else []), "adjusted", "standard deviation", ""):
        table.add_column(name)
    for path in paths:
        p = data["parameters"][path]
        declared, *after = (display(p[k], p["unit"]) for k in ("declared", "value", "sd"))
        given = [profiles["parameters"].get(path)] if profiles else []
        beside = ["-" if value is None else display(value, p["unit"]) for value in given]
        table.add_row(path, declared, *beside, *after, p["flag"] or "")
    return table


def profiles_note(profiles: dict[str, Any]) -> str:
    """Which pair, or why there is nothing of it."""
    return str(profiles["note"] or f"profiles: {profiles['wheel']} on {profiles['rail']}, over the measured motion")


def show_coefficients(call: Invocation, rows: list[dict[str, Any]] | None) -> None:
    """The coefficients that contradict their derivation."""
    if rows is None:
        return
    from rich.table import Table

    against = [r for r in rows if r["contradicts"]]
    if not against:
        call.show("no coefficient of the wheelset equations contradicts its derivation")
        return
    table = Table(title="coefficients that contradict their derivation", title_justify="left")
    for name in ("wheelset", "equation", "of", "difference", "unit", "sd away", "explains alone"):
        table.add_column(name)
    for r in against:
        table.add_row(
            str(r["wheelset"]), r["equation"], r["motion"], f"{r['difference']:.4g}", r["unit"], f"{r['t']:+.1f}",
            f"{100 * r['share']:.1f} %",
        )  # fmt: skip
    call.show(table)


def show_stretches(call: Invocation, data: dict[str, Any] | None) -> None:
    """The parameters that differ between stretches of track more than their standard deviations allow."""
    if data is None:
        return
    from rich.table import Table

    moving = {
        p: x
        for p, x in data["parameters"].items()
        if (x["chi2"] or 0.0) > SCATTER and max(x["values"]) - min(x["values"]) > LEAST * abs(x["values"][0])
    }
    if not moving:
        call.show(f"no parameter differs between the {len(data['between'])} stretches of track")
        return
    table = Table(title="parameters that differ between stretches of track", title_justify="left")
    table.add_column("path")
    for start, end in data["between"]:
        table.add_column(f"{start:.0f}-{end:.0f} m")
    table.add_column("chi2")
    for path, x in sorted(moving.items(), key=lambda item: -item[1]["chi2"]):
        table.add_row(path, *(f"{v:.4g}" for v in x["values"]), f"{x['chi2']:.1f}")
    call.show(table)
