"""railui plan: what a measurement campaign would detect and determine, before anything is measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import click

from railui.cli.arguments import design_argument, load_design_argument, quantity_option, split_overrides
from railui.cli.identification_tables import DETECTABLE_KINDS
from railui.cli.invocation import Invocation, StatusLine, common_options, usage_error
from railui.cli.quantities import parse_duration, parse_plot_path, parse_speeds
from railui.cli.tables import make_table


@click.command("plan")
@design_argument
@click.option("--sensors", required=True, metavar="FILE", help="Sensors that may be mounted, noise, costs (YAML).")
@quantity_option("--speeds", parse_speeds, required=True, metavar="RANGE", help="Speeds that may be run, 20:45:5.")
@click.option(
    "--track", "tracks", required=True, multiple=True, metavar="SPEC|FILE", help="Track; may be given several times."
)
@quantity_option("--duration", parse_duration, default="60 s", metavar="TIME", help="Duration of a run.")
@click.option("--noise", "noise", multiple=True, metavar="COLUMN=VALUE", help="Noise in place of the file's.")
@click.option("--budget", type=click.FloatRange(min=0, min_open=True), help="Largest cost, in place of the file's.")
@quantity_option("--plot", parse_plot_path, metavar="FILE", help="Write the page (.html) or the map of limits.")
@common_options
def command(
    design: str,
    overrides: dict[str, str],
    sensors: str,
    speeds: list[float],
    tracks: Sequence[str],
    duration: float,
    noise: tuple[str, ...],
    budget: float | None,
    plot: str | None,
    call: Invocation,
) -> None:
    """Plan a measurement campaign: which sensors and runs would detect which effects of DESIGN.

    \b
    railui plan design.yaml --sensors sensors.yaml --speeds 20:45:5 --track "erri_b176_low seed=1"
    railui plan design.yaml --sensors sensors.yaml --speeds 30,40 --track line.csv --budget 20 --plot plan.html

    Minimum detectable effects (90 % power), standard deviations of the parameters and confounded effects, for every run
    alone, for all runs, and for the selection of sensors and runs that gains most per cost. Expected for the nominal
    vehicle, to first order in every effect.
    """
    from railui.planning.plan import make_plan, plan_document
    from railui.planning.plan_file import load_plan

    loaded = load_design_argument(call, design, overrides)
    file = load_plan(sensors, loaded, split_overrides(noise))
    call.warn(file.campaign.warnings)
    if budget is not None:
        file = replace(file, budget=budget)
    try:
        plan = make_plan(file, speeds, tracks, duration, seed=call.seed, jobs=call.jobs, progress=StatusLine(call))
    except ValueError as error:
        raise usage_error(str(error)) from None
    head = {"overrides": overrides}
    files = [design, sensors, *(str(run.source.file) for run in plan.runs if run.source.file is not None)]
    document = call.document("plan", head | plan_document(plan), list(dict.fromkeys(files)))
    structure = loaded.structure
    for table in _tables(document, structure):
        call.show(table)
    if plot is not None:
        _write_plot(document, structure, plot)
        call.info(f"wrote {plot}")
    call.write_json(document)


def _write_plot(document: Mapping[str, Any], structure: Any, path: str) -> None:
    if path.lower().endswith(".html"):
        from railui.report.plan.page import write_plan_page

        write_plan_page(document, structure, path)
        return
    from railui.report.plan.figures import draw_plan
    from railui.report.plan.rows import effect_rows

    draw_plan(document, effect_rows(document, structure=structure), path)


def _tables(document: Mapping[str, Any], structure: Any) -> list[Any]:
    from railui.report.plan.rows import effect_rows, parameter_rows, sentence

    runs = [run["name"] for run in document["runs"]]
    steps = [(s["added"], f"{s['cost']:g}", f"{100 * s['attained_share']:.0f} %") for s in document["steps"]]
    effects = [
        (row["name"], row["parameter"], row["bound"], *row["cells"])
        for row in effect_rows(document, kinds=DETECTABLE_KINDS, structure=structure)
    ]
    parameters = [(row["name"], row["prior"], *row["cells"]) for row in parameter_rows(document)]
    columns = ("selection", "everything", *runs)
    notes = "\n".join(document["notes"])
    return [
        make_table(("added", "cost", "precision"), steps, title="selection of sensors and runs", caption=notes),
        make_table(
            ("effect", "parameter", "", *columns), effects, title="minimum detectable effects (nominal power 90 %)"
        ),
        make_table(
            ("parameter", "prior", *columns), parameters, title="standard deviations, relative to the nominal value"
        ),
        sentence(document),
    ]
