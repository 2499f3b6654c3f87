"""railui plan: what a measurement campaign would detect and determine, before anything is measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from railui.cli.arguments import load_design_argument, overrides_argument, quantity_option, split_overrides
from railui.cli.identification_tables import DETECTABLE_KINDS
from railui.cli.invocation import Invocation, StatusLine, common_options, usage_error
from railui.cli.quantities import parse_duration, parse_plot_path, parse_speeds
from railui.cli.tables import make_table

if TYPE_CHECKING:
    from railui.planning.after import FinishedLoop
    from railui.planning.next_run import NextRun

DURATION: Final = 60.0  # s of a run
MAX_ROWS: Final = 12  # next runs shown


@click.command("plan")
@click.argument("design", metavar="[DESIGN]", required=False)
@overrides_argument
@click.option("--sensors", metavar="FILE", help="Sensors that may be mounted, noise, costs (YAML).")
@quantity_option("--speeds", parse_speeds, metavar="RANGE", help="Speeds that may be run, such as 20:45:5.")
@click.option("--track", "tracks", multiple=True, metavar="SPEC|FILE", help="Track; may be given several times.")
@click.option("--sections", type=click.IntRange(1, 50), default=1, help="Places along each track to start from.")
@quantity_option("--duration", parse_duration, metavar="TIME", help="Duration of a run; 60 s by default.")
@click.option("--noise", "noise", multiple=True, metavar="COLUMN=VALUE", help="Noise in place of the file's.")
@click.option("--budget", type=click.FloatRange(min=0, min_open=True), help="Largest cost, in place of the file's.")
@quantity_option("--plot", parse_plot_path, metavar="FILE", help="Write the page (.html) or the map of limits.")
@click.option("--store", metavar="DIR", help="Keep what was computed of every run; read again, a plan resumes.")
@click.option("--after", metavar="DIR", help="Results of a loop: which next run separates its rival models?")
@click.option("--measured", metavar="RUN", help="With --after: the next run, once measured; it decides.")
@common_options
def command(
    design: str | None,
    overrides: dict[str, str],
    sensors: str | None,
    speeds: list[float] | None,
    tracks: Sequence[str],
    sections: int,
    duration: float | None,
    noise: tuple[str, ...],
    budget: float | None,
    plot: str | None,
    store: str | None,
    after: str | None,
    measured: str | None,
    call: Invocation,
) -> None:
    """Plan a measurement campaign: which sensors and runs would detect which effects of DESIGN.

    \b
    railui plan design.yaml --sensors sensors.yaml --speeds 20:45:5 --track "erri_b176_low seed=1"
    railui plan design.yaml --sensors sensors.yaml --speeds 30,40 --track line.csv --budget 20 --plot plan.html
    railui plan --after railui-loop/NAME --speeds 20:40:5
    railui plan --after railui-loop/NAME --measured run_c.csv.gz

    Minimum detectable effects (90 % power), standard deviations of the parameters and confounded effects, for every run
    alone, for all runs, and for the selection of sensors and runs that gains most per cost. Expected for the nominal
    vehicle, to first order in every effect.

    With --after, the runs that may be made next are ranked by the probability that they separate the models that a loop
    left undecided; --measured compares the predictions of these models with such a run by Vuong's test.
    """
    if after is not None:
        if design is not None:
            raise usage_error("--after takes the vehicle of the loop: leave DESIGN out")
        if budget is not None or plot is not None or store is not None:
            raise usage_error("--budget, --plot and --store are for a plan before any measurement: leave them out")
        _after(after, sensors, speeds, tracks, sections, duration, noise, measured, call)
        return
    if measured is not None:
        raise usage_error("--measured is for --after DIR, the results of a loop")
    missing = [name for name, value in (("DESIGN", design), ("--sensors", sensors), ("--speeds", speeds)) if not value]
    if missing or not tracks or design is None or sensors is None or speeds is None:
        raise usage_error(f"give {', '.join([*missing, *([] if tracks else ['--track'])])}, or --after DIR")
    _before(
        design, overrides, sensors, speeds, tracks, sections, duration or DURATION, noise, budget, plot, store, call
    )


def _before(
    design: str,
    overrides: dict[str, str],
    sensors: str,
    speeds: list[float],
    tracks: Sequence[str],
    sections: int,
    duration: float,
    noise: tuple[str, ...],
    budget: float | None,
    plot: str | None,
    store: str | None,
    call: Invocation,
) -> None:
    """Plan before any measurement."""
    from railui.planning.plan import make_plan, plan_document
    from railui.planning.plan_file import load_plan
    from railui.planning.store import InformationStore

    loaded = load_design_argument(call, design, overrides)
    file = load_plan(sensors, loaded, split_overrides(noise))
    call.warn(file.campaign.warnings)
    if budget is not None:
        file = replace(file, budget=budget)
    try:
        plan = make_plan(
            file,
            speeds,
            tracks,
            duration,
            seed=call.seed,
            jobs=call.jobs,
            progress=StatusLine(call),
            store=None if store is None else InformationStore(Path(store)),
            sections=sections,
        )
    except ValueError as error:
        raise usage_error(str(error)) from None
    files = [design, sensors, *(str(run.source.file) for run in plan.runs if run.source.file is not None)]
    body = {"overrides": overrides} | plan_document(plan)
    document = call.document("plan", body, list(dict.fromkeys(files)))
    for table in _tables(document, loaded.structure):
        call.show(table)
    if plot is not None:
        _write_plot(document, loaded.structure, plot)
        call.info(f"wrote {plot}")
    call.write_json(document)


def _after(
    directory: str,
    sensors: str | None,
    speeds: list[float] | None,
    tracks: Sequence[str],
    sections: int,
    duration: float | None,
    noise: tuple[str, ...],
    measured: str | None,
    call: Invocation,
) -> None:
    """Rank the next runs after a loop, or compare its rivals on one that has been measured."""
    from railui.planning.after import load_finished_loop, propose_runs
    from railui.planning.plan_file import load_plan
    from railui.planning.rivals import undecided
    from railui.report.loop.next_run import rival_text, run_row

    loop = load_finished_loop(directory, seed=call.seed or 0, jobs=call.jobs, progress=StatusLine(call))
    vehicle = loop.context.campaign.design
    rivals = [r.key | {"z": r.z} for r in loop.rivals]
    names = [rival_text(r, vehicle.structure) for r in rivals]
    settings = loop.context.settings.planning
    open_ones = len(undecided(loop.rivals, settings))
    body: dict[str, Any] = {"after": directory, "rivals": rivals, "undecided": open_ones - 1}
    inputs = [str(loop.directory / "loop.json"), str(loop.context.campaign.source)]
    against = [(n, f"{r['z']:.2f}") for n, r in zip(names[1:], rivals[1:], strict=True)]
    caption = f"above {settings.critical_z:.2f}: separated by the data of the loop"
    call.show(make_table(("model", "z of the final model"), [(names[0], "final"), *against], caption=caption))
    if measured is not None:
        body["decisions"] = _decide(loop, measured, names, call)
        call.write_json(call.document("plan", body, [*inputs, measured]))
        return
    if open_ones < 2:
        call.show("The data of the loop separate the final model from all others: no further run is needed for that.")
    levels: dict[str, float] = {}
    if sensors is not None:
        file = load_plan(sensors, vehicle, split_overrides(noise))
        levels = {c: file.campaign.noise[c] for c in file.sensors}
    try:
        found = propose_runs(loop, speeds, list(tracks) or None, duration, levels, sections) if open_ones > 1 else []
    except ValueError as error:
        raise usage_error(str(error)) from None
    body["next_runs"] = [run_row(run) for run in found]
    if found:
        rows = [
            (r.run.name, " ".join(r.sensors), f"{100 * r.probability:.0f} %", *_chances(r, open_ones))
            for r in found[:MAX_ROWS]
        ]
        columns = ("run", "sensors", "separates", *names[1:open_ones])
        call.show(make_table(columns, rows, title=f"next runs of {found[0].run.duration:.0f} s, the best first"))
    call.write_json(call.document("plan", body, inputs))


def _chances(run: NextRun, rivals: int) -> list[str]:
    chance = {p.rival: p.probability for p in run.prospects}
    return [f"{100 * chance[j]:.0f} %" if j in chance else "-" for j in range(1, rivals)]


def _decide(loop: FinishedLoop, measured: str, names: Sequence[str], call: Invocation) -> list[dict[str, Any]]:
    """Compare all rivals on a measured run and print the decisions."""
    from railui.campaign.dataset import segments_of_run
    from railui.planning.next_run import decide
    from railui.runs.run import load_run

    kind = loop.context.campaign.design.run_form
    run = load_run(Path(measured), kind)
    call.warn(run.warnings)
    segments = segments_of_run(run, Path(measured).name, "test", kind)
    decisions = decide(loop.context, loop.rivals, segments)
    rows = [
        (names[d.rival], f"{d.z:.2f}", (names[0] if d.z > 0 else names[d.rival]) if d.is_clear else "undecided")
        for d in decisions
    ]
    call.show(make_table(("final model against", "z", "better on the run (5 % level)"), rows, title=measured))
    return [{"rival": d.rival, "z": d.z, "clear": d.is_clear} for d in decisions]


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
