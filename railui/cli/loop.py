"""railui loop: calibration of a model and identification of an unmodelled effect."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli import EXIT_LIMIT_VIOLATED
from railui.cli.arguments import quantity_option
from railui.cli.invocation import Invocation, RunLog, common_options, usage_error
from railui.cli.quantities import parse_budget

if TYPE_CHECKING:
    from railui.api.loop import Loop
    from railui.identification.result import LoopResult

REJECTED_VERDICTS = ("partial", "outside", "data")  # that fail with --strict


@click.command("loop")
@click.argument("campaign", metavar="CAMPAIGN")
@click.option(
    "-o", "--out", metavar="DIR", help="Directory of the results; railui-loop next to the campaign by default."
)
@click.option("--without", metavar="KIND,KIND", default="", help="Effects excluded from the structure detection.")
@quantity_option(
    "--budget", parse_budget, metavar="TIME", help="Time after which the search ends with the best answer so far [s]."
)
@click.option(
    "--export-element", "element", metavar="FILE", help="Write the component of a bench campaign as an element."
)
@click.option("--prior", metavar="DIR", help="Results of an earlier loop, whose estimates are the priors.")
@click.option("--strict", is_flag=True, help="Exit code 4 for the verdicts partial, outside and data.")
@click.option("--correct", is_flag=True, help="Correct data faults and go on, where each has one correction.")
@click.option("--accept-data", is_flag=True, help="Go on despite data faults.")
@common_options
@click.pass_context
def command(
    ctx: click.Context,
    campaign: str,
    out: str | None,
    without: str,
    budget: float | None,
    element: str | None,
    prior: str | None,
    correct: bool,
    accept_data: bool,
    strict: bool,
    call: Invocation,
) -> None:
    """Calibrate the model of a CAMPAIGN (its directory or campaign.yaml) and identify an unmodelled effect.

    \b
    railui loop designs/campaigns/worn_axle_box
    railui loop campaign.yaml -o results --json - --seed 1
    railui loop designs/campaigns/mr_damper --export-element damper.yaml

    The parameters of the nominal model are estimated from the runs of role adjust; a score test and candidate
    refits select an effect of the library that explains the residual; the effect is added and all parameters are
    estimated again. The error is that of the runs of role validate: no parameter of the vehicle is fitted to
    them, but they decide which effects are accepted. The independent test is on runs of role test, which decide
    nothing; without such runs the last third of every validation run is held back for it. A data fault (a wrong sign
    or unit, exchanged channels, a track recorded elsewhere, clocks that run apart, clipping) stops the loop before any
    fit, with the line of the campaign file that corrects it. Verdicts: none, effect, partial, outside, data; all have
    exit code 0 without --strict. --export-element writes the component of a campaign with `rig: {input: motion}` as a
    file that a design mounts by `effects: [{element: FILE, at: PLACE}]`. --prior starts from the calibrated vehicle and
    the estimates of an earlier loop, effects included, and reports what has changed since.
    """
    from railui.api.campaign import Campaign
    from railui.api.loop import run_loop
    from railui.campaign.directory import campaign_file
    from railui.io.atomic import check_directory_writable
    from railui.report.figures.drawing import preload_in_background
    from railui.report.loop.element_file import NoElementError
    from railui.report.loop.files import ForeignFilesError, check_directory

    excluded = excluded_kinds(without)
    source = campaign_file(campaign)
    loaded = Campaign.load(source)
    if prior is not None:
        loaded = loaded.with_prior(prior)
    call.warn(loaded.warnings)
    if element is not None and loaded.design.form != "bench":
        raise usage_error("--export-element is for a component on a bench, `vehicle: {rig: {input: motion}}`")
    directory = Path(out) if out is not None else source.parent / "railui-loop"
    try:
        check_directory(directory)
    except ForeignFilesError as error:
        raise usage_error(str(error)) from None
    check_directory_writable(directory)
    preload_in_background()
    log = RunLog(call)
    call.warn([warning for run in loaded.dataset.runs for warning in run.warnings])
    loop = run_loop(
        loaded,
        without=excluded,
        seed=call.seed or 0,
        jobs=call.jobs,
        correct=correct,
        accept_data=accept_data,
        progress=log,
        budget=budget,
    )
    call.write_json(loop.data)  # before the files and tables: neither a figure that fails nor a closed pipe loses it
    try:
        loop.save(directory, log.lines)
    except Exception:
        call.show(f"\n{loop.sentence}\n")
        raise
    if element is not None and loop.result is not None:
        try:
            loop.save_element(element)
        except NoElementError as error:
            raise usage_error(str(error)) from None
    _show(call, loop, directory)
    if element is not None and loop.result is not None:
        call.info(f"wrote the element {element}")
    ctx.exit(EXIT_LIMIT_VIOLATED if strict and loop.verdict in REJECTED_VERDICTS else 0)


def excluded_kinds(text: str) -> list[str]:
    """Parse the kinds of --without; the usage error for an unknown kind suggests the nearest."""
    from railui.api.library import effects
    from railui.io.problems import suggest_name

    kinds = [kind.strip() for kind in text.split(",") if kind.strip()]
    known = [str(entry["kind"]) for entry in effects()]
    for kind in kinds:
        if kind not in known:
            raise usage_error(f"no effect {kind!r} in the catalogue, {suggest_name(kind, known)}")
    return kinds


def _show(call: Invocation, loop: Loop, directory: Path) -> None:
    """Print the verdict, what it rests on, and the files that were written."""
    call.show(f"\n{loop.sentence}\n")
    if loop.result is not None:
        _show_identification(call, loop.result, loop.data)
        call.info(f"wrote to {directory}: loop.json, adjusted.yaml, campaign.yaml, report.html, simulated channels")
    elif loop.checked is not None:
        for fault in loop.checked.remaining.faults:
            if not fault.serious:
                call.show(f"{', '.join(fault.files)}: {fault.text}")
        corrected = ", campaign.yaml with the corrections" if loop.checked.remaining.is_correctable else ""
        call.info(f"wrote to {directory}: loop.json, report.html{corrected}")


def _show_identification(call: Invocation, result: LoopResult, report: Mapping[str, Any]) -> None:
    """Print errors, notes, contact parameters and effects."""
    from railui.cli.identification_tables import (
        conditions_table,
        detectable_table,
        effects_table,
        errors_table,
        parameters_table,
        profiles_note,
    )
    from railui.report.loop.conditions import condition_notes
    from railui.report.loop.notes import notes_on_errors
    from railui.report.loop.summary import summary_lines

    for line in summary_lines(report):
        call.show(line)
    call.show("")
    call.show(errors_table(report))
    for note in notes_on_errors(result):
        call.show(f"{note}\n")
    if report["conditions"] is not None:
        for note in condition_notes(result):
            call.show(f"{note}\n")
        call.show(conditions_table(report["conditions"]))
    if report["profiles"]:
        call.show(parameters_table(report, [path for path in report["parameters"] if path.startswith("contact.")]))
        call.show(profiles_note(report["profiles"]))
    if report["effects"]:
        call.show(effects_table(report, result.nominal.design.structure))
    elif report["outside"] is None and report["detectable"]:
        call.show(detectable_table(report))
