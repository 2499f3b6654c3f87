"""railui adjust: parameter estimation from a campaign."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from railui.cli.arguments import quantity_option
from railui.cli.invocation import Invocation, RunLog, common_options, usage_error
from railui.cli.quantities import parse_segment_length
from railui.cli.tables import format_fixed

if TYPE_CHECKING:
    from railui.identification.result import LoopResult
    from railui.progress import Progress

# keys of the loop report that the estimation alone does not determine
LOOP_ONLY_KEYS = (
    "verdict",
    "out_of_time",
    "explained",
    "remainder",
    "leave_one_run_out",
    "sentence",
    "ranking",
    "traces",
    "detectable",
    "classes",
    "outside",
)


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
    from railui.campaign.campaign import load_campaign
    from railui.campaign.dataset import read_dataset
    from railui.documents.recognise import expect_kind
    from railui.identification.loop import calibrate_only
    from railui.report.loop.data import loop_report

    expect_kind(campaign, "campaign")
    loaded = load_campaign(campaign)
    call.warn(loaded.warnings)
    paths = profiled_paths(profiled, loaded.estimated_parameters)
    if loaded.design.kind != "bogie" and (coefficients or stretch is not None):
        raise usage_error("--coefficients and --stretch are for vehicles on a track, this campaign is of a rig")
    log = RunLog(call)
    dataset = read_dataset(loaded)
    call.warn([warning for run in dataset.runs for warning in run.warnings])
    result = calibrate_only(dataset, method=method, seed=call.seed or 0, jobs=call.jobs, progress=log)
    report = loop_report(result) | {"schema": "railui.adjust/1", "method": method}
    for key in LOOP_ONLY_KEYS:
        report.pop(key)
    report |= _further_analyses(result, coefficients, stretch, paths, method, log)
    call.write_json(report)  # before the tables: a closed pipe must not lose it
    _show(call, result, report)


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


def _further_analyses(
    result: LoopResult,
    coefficients: bool,
    section_length: float | None,
    profiled: list[str],
    method: str,
    progress: Progress,
) -> dict[str, Any]:
    """Return the results of the analyses that the options ask for, as data."""
    from railui.identification.estimation.identifiability import estimate_per_section, profile_likelihoods
    from railui.identification.estimation.parallel_models import residual_correlations
    from railui.identification.unmodelled.coefficients import estimate_coefficients
    from railui.io.atomic import to_json_value
    from railui.report.loop.identifiability import coefficient_rows, correlation_rows, profile_rows, segment_rows

    context = replace(result.context, progress=progress)
    fit = result.before
    data: dict[str, Any] = {}
    if method == "two-parallel-models":
        data["correlations"] = correlation_rows(residual_correlations(context, fit))
    if coefficients:
        data["coefficients"] = coefficient_rows(estimate_coefficients(context, fit))
    if section_length is not None:
        data["stretches"] = segment_rows(estimate_per_section(context, fit, section_length))
    if profiled:
        data["profile"] = profile_rows(profile_likelihoods(context, fit, profiled))
    return dict(to_json_value(data))


def _show(call: Invocation, result: LoopResult, report: dict[str, Any]) -> None:
    """Print the parameters, their identifiability, the errors and the further analyses."""
    from railui.cli.identification_tables import coefficients_table, parameters_table, profiles_note, sections_table
    from railui.io.number_format import format_quantity
    from railui.report.loop.notes import unstated_track_noise_notes

    call.show(parameters_table(report, list(report["parameters"])))
    if report["profiles"]:
        call.show(profiles_note(report["profiles"]))
    for sentence in report["identifiability"]["words"]:
        call.show(sentence)
    nominal, calibrated, floor = (format_fixed(report[key]["nrmse"]) for key in ("declared", "after", "floor"))
    call.show(f"NRMSE on the validation runs: nominal {nominal}, calibrated {calibrated}, noise floor {floor}")
    for note in unstated_track_noise_notes(result.dataset):
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
