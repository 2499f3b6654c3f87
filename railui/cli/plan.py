"""railui plan: what a measurement campaign would detect and determine, before anything is measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import click

from railui.cli.arguments import load_design_argument, overrides_argument, quantity_option, split_overrides
from railui.cli.cluster import connect
from railui.cli.invocation import Invocation, StatusLine, common_options, usage_error, usage_errors
from railui.cli.plan_after import Candidates, plan_after
from railui.cli.quantities import parse_duration, parse_plot_path, parse_speeds
from railui.cli.tables import make_table

NOT_STORED = "start the command again, with --store DIR for a plan that resumes"


@dataclass(frozen=True)
class Outputs:
    """Options of a plan before any measurement."""

    budget: float | None
    plot: str | None
    store: str | None
    scheduler: str | None

    @property
    def are_default(self) -> bool:
        """True where none was given."""
        return all(x is None for x in vars(self).values())


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
@click.option("--scheduler", metavar="ADDRESS", help="Distribute the runs: tcp://host:8786 of a dask scheduler.")
@click.option("--after", metavar="DIR", help="Results of a loop: which next run separates its rival models?")
@click.option("--measured", metavar="RUN", help="With --after: the next run, once measured; it decides.")
@click.option("--load", "loads", multiple=True, metavar="NAME", help="With --after: a load state of the next run.")
@click.option("--bench", metavar="PLACE", help="With --after: `all` components on a bench, or that of --measured.")
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
    scheduler: str | None,
    after: str | None,
    measured: str | None,
    loads: tuple[str, ...],
    bench: str | None,
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
    outputs = Outputs(budget, plot, store, scheduler)
    candidates = Candidates(sensors, speeds, tracks, sections, duration, split_overrides(noise), loads, bench)
    if after is not None:
        if design is not None:
            raise usage_error("--after takes the vehicle of the loop: leave DESIGN out")
        if not outputs.are_default:
            raise usage_error(
                "--budget, --plot, --store and --scheduler are for a plan before any measurement: leave them out"
            )
        plan_after(after, candidates, measured, call)
        return
    if measured is not None or loads or bench is not None:
        raise usage_error("--measured, --load and --bench are for --after DIR, the results of a loop")
    missing = [name for name, value in (("DESIGN", design), ("--sensors", sensors), ("--speeds", speeds)) if not value]
    if missing or not tracks or design is None:
        raise usage_error(f"give {', '.join([*missing, *([] if tracks else ['--track'])])}, or --after DIR")
    _plan_before(design, overrides, candidates, outputs, call)


def _plan_before(
    design: str, overrides: dict[str, str], candidates: Candidates, outputs: Outputs, call: Invocation
) -> None:
    """Plan before any measurement."""
    from railui.api.plan import candidate_runs, compute_plan, read_plan_file

    loaded = load_design_argument(call, design, overrides)
    file = read_plan_file(loaded, str(candidates.sensors), candidates.noise, outputs.budget)
    call.warn(file.campaign.warnings)
    speeds, sections = candidates.speeds or [], candidates.sections
    with usage_errors():
        runs = candidate_runs(file, speeds, candidates.tracks, candidates.duration, seed=call.seed, sections=sections)
    remedy = NOT_STORED if outputs.store is None else None
    cluster = None if outputs.scheduler is None else connect(outputs.scheduler, call, remedy)
    machine: dict[str, Any] = {"cluster": cluster, "jobs": call.jobs, "progress": StatusLine(call)}
    try:
        plan = compute_plan(loaded, file, runs, store=outputs.store, seed=call.seed, **machine)
    finally:
        if cluster is not None:
            cluster.close()
    document = call.document("plan", plan.body(), [design, *map(str, plan.inputs[1:])])
    for table in _tables(document, loaded.structure):
        call.show(table)
    if outputs.plot is not None:
        call.info(f"wrote {plan.save(outputs.plot)}")
    call.write_json(document)


def _tables(document: Mapping[str, Any], structure: Any) -> list[Any]:
    from railui.report.plan.rows import effect_rows, marks_legend, parameter_rows, sentence

    runs = [run["name"] for run in document["runs"]]
    steps = [(s["added"], f"{s['cost']:g}", f"{100 * s['attained_share']:.0f} %") for s in document["steps"]]
    shown = effect_rows(document, only_common=True, structure=structure)
    effects = [(row["name"], row["parameter"], row["bound"], *row["cells"]) for row in shown]
    parameters = [(row["name"], row["prior"], *row["cells"]) for row in parameter_rows(document)]
    columns = ("selection", "everything", *runs)
    notes = "\n".join(document["notes"])
    return [
        make_table(("added", "cost", "precision"), steps, title="selection of sensors and runs", caption=notes),
        make_table(
            ("effect", "parameter", "", *columns),
            effects,
            title="minimum detectable effects (nominal power 90 %)",
            caption="\n".join(marks_legend(shown)),
        ),
        make_table(
            ("parameter", "prior", *columns), parameters, title="standard deviations, relative to the nominal value"
        ),
        sentence(document),
    ]
