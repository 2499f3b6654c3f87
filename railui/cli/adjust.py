"""railui adjust: parameter estimation from a campaign."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from railui.cli.arguments import quantity_option
from railui.cli.invocation import Invocation, RunLog, common_options, usage_error
from railui.cli.quantities import parse_segment_length
from railui.cli.tables import format_fixed

if TYPE_CHECKING:
    from railui.identification.result import LoopResult


@click.command("adjust")
@click.argument("campaign", metavar="CAMPAIGN")
@click.option("--coefficients", is_flag=True, help="Estimate the 16 coefficients of the wheelset equations as well.")
@quantity_option(
    "--stretch",
    parse_segment_length,
    metavar="LENGTH",
    help='Estimate parameters per track section of this length, such as 500 or "0.5 km".',
)
@click.option(
    "--method",
    type=click.Choice(["least-squares", "two-parallel-models"]),
    default="least-squares",
    show_default=True,
    help="All parameters at once, or Broersen's two parallel models, one parameter at a time.",
)
@click.option(
    "--profile", "profiled", metavar="PATH,PATH", help='Compute the profile likelihood of these parameters; "all".'
)
@common_options
def command(
    campaign: str, coefficients: bool, stretch: float | None, method: str, profiled: str | None, call: Invocation
) -> None:
    """Estimate the parameters of the nominal model from a CAMPAIGN, without searching for effects.

    \b
    railui adjust designs/campaigns/worn_axle_box --json -
    railui adjust campaign.yaml --coefficients --stretch 500
    railui adjust campaign.yaml --profile contact.leading.conicity,vehicle.secondary.yaw_damping
    railui adjust campaign.yaml --method two-parallel-models

    Output-error least squares over all channels of the runs of role adjust; the error is that of the runs of
    role validate.
    """
    from railui.api.campaign import Campaign
    from railui.api.fit import estimate

    loaded = Campaign.load(campaign)
    call.warn(loaded.warnings)
    paths = profiled_paths(profiled, loaded.estimated_parameters)
    if loaded.design.kind != "bogie" and (coefficients or stretch is not None):
        raise usage_error("--coefficients and --stretch are for vehicles on a track, this campaign is of a rig")
    call.warn([warning for run in loaded.dataset.runs for warning in run.warnings])
    fit = estimate(
        loaded,
        method=method,
        coefficients=coefficients,
        section_length=stretch,
        profile=paths,
        seed=call.seed or 0,
        jobs=call.jobs,
        progress=RunLog(call),
    )
    call.write_json(fit.data)  # before the tables: a closed pipe must not lose it
    _show(call, fit.result, fit.data)


def profiled_paths(text: str | None, estimated: Sequence[str]) -> list[str]:
    """Parse the parameters of --profile; the usage error for one that is not estimated suggests the nearest."""
    from railui.io.problems import suggest_name

    if text is None:
        return []
    paths = list(estimated) if text.strip() == "all" else [p.strip() for p in text.split(",") if p.strip()]
    for path in paths:
        if path not in estimated:
            raise usage_error(f"{path!r} is not estimated in this campaign, {suggest_name(path, list(estimated))}")
    return paths


def _show(call: Invocation, result: LoopResult, report: Mapping[str, Any]) -> None:
    """Print the parameters, their identifiability, the errors and the further analyses."""
    from railui.cli.identification_tables import coefficients_table, parameters_table, profiles_note, sections_table
    from railui.io.number_format import format_quantity
    from railui.report.loop.notes import absent_cross_level_notes, unstated_track_noise_notes

    call.show(parameters_table(report, list(report["parameters"])))
    if report["profiles"]:
        call.show(profiles_note(report["profiles"]))
    for sentence in report["identifiability"]["words"]:
        call.show(sentence)
    nominal, calibrated, floor = (format_fixed(report[key]["nrmse"]) for key in ("declared", "after", "floor"))
    call.show(f"NRMSE on the validation runs: nominal {nominal}, calibrated {calibrated}, noise floor {floor}")
    for note in [*absent_cross_level_notes(result.dataset), *unstated_track_noise_notes(result.dataset)]:
        call.show(note)
    if "coefficients" in report:
        call.show(coefficients_table(report["coefficients"]))
    if "stretches" in report:
        call.show(sections_table(report["stretches"]))
    for path, profile in report.get("profile", {}).items():
        unit = report["parameters"][path]["unit"]
        low, high = ("open" if profile[end] is None else format_quantity(profile[end], unit) for end in ("low", "high"))
        call.show(f"profile likelihood of {path}: 90 % interval from {low} to {high}")
    call.info(f"{result.before.simulations} simulations")
