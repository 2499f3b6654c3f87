"""railui optimise: optimisation of a suspension."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli import EXIT_LIMIT_VIOLATED
from railui.cli.cluster import connect
from railui.cli.invocation import InfoLines, Invocation, StatusLine, common_options
from railui.cli.sobol_table import sobol_table
from railui.cli.tables import format_cell, format_count, make_table

if TYPE_CHECKING:
    from railui.execution.tasks import Runner
    from railui.optimisation.study import Study

# designs for each of the variables and two more: four times the designs of a usual search of three variables; intervals
# of the bundled study are 0.25 wide at most, of 256 samples 0.5
SOBOL_SAMPLES = 1024


def _power_of_two(_: click.Context, __: click.Parameter, value: int) -> int:
    if value & (value - 1):
        raise click.BadParameter(
            f"{value} is no power of two: give {2 ** (value.bit_length() - 1)} or {2 ** value.bit_length()}"
        )
    return value


@click.command("optimise")
@click.argument("study", metavar="STUDY")
@click.option(
    "-o", "--output", metavar="DIR", help="Directory of the result; railui-study/NAME next to the study by default."
)
@click.option("--scheduler", metavar="ADDRESS", help="Distribute the work: tcp://host:8786 of a dask scheduler.")
@click.option(
    "--choose",
    type=click.IntRange(min=0),
    multiple=True,
    metavar="N",
    help="Write design N of the front, numbered from 0, as a design file.",
)
@click.option("--sensitivities", is_flag=True, help="Compute Sobol indices of the objectives over the ranges, too.")
@click.option(
    "--samples",
    type=click.IntRange(min=16),
    default=SOBOL_SAMPLES,
    show_default=True,
    callback=_power_of_two,
    metavar="N",
    help="Samples of the Sobol indices, a power of two; N x (variables + 2) designs.",
)
@click.option("--unlock", is_flag=True, help="Take over the directory from a process that ended on another machine.")
@click.option("--dry-run", is_flag=True, help="Print the size of the search and stop.")
@common_options
@click.pass_context
def command(
    ctx: click.Context,
    study: str,
    output: str | None,
    scheduler: str | None,
    choose: tuple[int, ...],
    sensitivities: bool,
    samples: int,
    unlock: bool,
    dry_run: bool,
    call: Invocation,
) -> None:
    """Search the variables of STUDY for better designs: multi- or single-objective optimisation.

    Evaluations are stored in DIR as they complete: the same command resumes an interrupted search, with the same
    result. DIR gets copies of the study and the vehicle, the result, the Pareto front, a report and the design
    at the knee point. Exit code 4 where no design satisfies the constraints, or all designs fail.
    """
    from railui.api.study import Study
    from railui.optimisation.failures import all_failed, failure_line

    loaded = Study.load(study)
    call.warn(loaded.warnings)
    if call.seed is not None:
        loaded = replace(loaded, method=replace(loaded.method, seed=call.seed))
    directory = Path(output) if output is not None else _default_directory(Path(study))
    if dry_run:
        _show_plan(loaded, directory, call)
        return
    inputs = [study, *([str(loaded.design.source)] if loaded.design.source else []), *_track_files(loaded)]
    samples = samples if sensitivities else 0
    document = _search(loaded, directory, _runner(scheduler, call), unlock, samples, inputs, choose, call)
    call.write_json(document)
    if failed := failure_line(document):
        call.info(failed)
    if document["knee"] is None:
        if all_failed(document):
            call.info("no design can be compared: narrow the ranges of the variables, or change the cases")
            ctx.exit(EXIT_LIMIT_VIOLATED)
        nearest = ", ".join(f"{path} {value:.6g}" for path, value in document["closest"].items())
        call.info(f"no design satisfies the constraints; the nearest [SI]: {nearest}")
        ctx.exit(EXIT_LIMIT_VIOLATED)


def _search(
    study: Study,
    directory: Path,
    runner: Runner,
    unlock: bool,
    samples: int,
    inputs: list[str],
    choose: tuple[int, ...],
    call: Invocation,
) -> dict[str, Any]:
    """Run or resume the search, write its files and show the result; return the document."""
    from railui.api.optimisation import search_in_directory

    data, written = search_in_directory(
        study,
        directory,
        runner,
        unlock=unlock,
        jobs=call.jobs,
        samples=samples,
        choose=choose,
        inputs=inputs,
        progress=StatusLine(call),
        warnings=InfoLines(call),
    )
    call.warn(data["warnings"])
    call.show(_table(data))
    if data["sensitivities"]["sobol"] is not None:
        call.show(sobol_table(data))
    call.info(f"wrote {', '.join(str(path) for path in written)}")
    return call.document("optimise", data, inputs, study.method.seed)


def _default_directory(source: Path) -> Path:
    """Return the directory of a search: that of the study where it is the copy in one, else one next to it."""
    from railui.execution.cache import DATABASE
    from railui.execution.outputs import STUDY_FILE

    if source.name == STUDY_FILE and (source.parent / DATABASE).is_file():
        return source.parent
    return source.parent / "railui-study" / source.stem


def _runner(scheduler: str | None, call: Invocation) -> Runner:
    if scheduler is None:
        from railui.execution.threads import ThreadRunner

        return ThreadRunner(call.jobs)
    return connect(scheduler, call)


def _show_plan(study: Study, directory: Path, call: Invocation) -> None:
    from railui.api.optimisation import FRESH_SEED_SETS, search_size
    from railui.execution.outputs import check_directory

    check_directory(study, directory)
    size = search_size(study)
    again = f", then the front on {FRESH_SEED_SETS} sets of fresh seeds" if size.has_seeds else ""
    call.show(
        f"{size.designs} designs by {study.method.kind} on {format_count(size.cases, 'case')}, "
        f"{size.steps:.1e} time steps{again}; to {directory}"
    )
    body = {"study": study.name, "evaluations": size.designs, "cases": size.cases, "samples": size.steps}
    call.write_json(call.document("plan", body, [study.source], study.method.seed))


def _track_files(study: Study) -> list[str]:
    from railui.track.excitation import is_track_file

    paths = [study.directory / track for track in study.cases.track]
    return [str(path) for path in paths if is_track_file(path) and path.is_file()]


def _table(result: Mapping[str, Any]) -> Any:
    """Return the table of ride quality (means over the cases), objectives with their spread, and constraints.

    On fresh seeds: the paired difference of the knee to the baseline, and in how many sets constraints are met.
    """
    baseline, knee = (result["riding"][when] or {} for when in ("before", "after"))
    ride_quality = [
        (f"{key}, worst" if key == "class" else key, format_cell(baseline.get(key)), format_cell(knee.get(key)))
        for key in baseline or knee
    ]
    points = (result["baseline"], None if result["knee"] is None else result["pareto"][result["knee"]])
    is_repeated = any(x is not None for point in points if point for x in point["fresh"]["mean"])
    repeated = " (fresh seeds)" if is_repeated else ""
    objectives = [
        (f"{aim['sense']} {aim['key']}, {aim['over']}{repeated}", *(_objective(point, i) for point in points))
        for i, aim in enumerate(result["aims"])
    ]
    differences = [
        (f"{aim['key']}, {aim['over']}: knee minus baseline{repeated}", "", _difference(points[1], i))
        for i, aim in enumerate(result["aims"])
        if is_repeated
    ]
    failures = [("failed on fresh seeds", *map(_failures, points))] if any(map(_has_failed, points)) else []
    constraints = [(limit, *(_constraint(point, i) for point in points)) for i, limit in enumerate(result["limits"])]
    columns = ("ride quality, mean of the cases", "baseline", "knee point")
    designs, cases = format_count(len(result["pareto"]), "design"), format_count(result["cases"], "case")
    title = f"{result['study']}: {designs} on the Pareto front, {cases}"
    return make_table(
        columns,
        ride_quality,
        [*objectives, *differences, *failures, *constraints],
        title=title,
        caption="\n".join(result["notes"]),
    )


def _objective(point: Mapping[str, Any] | None, i: int) -> str:
    if point is None:
        return "-"
    mean, sd = (point["fresh"][key][i] for key in ("mean", "sd"))
    spread = "" if mean is None or sd is None else f" ({mean:.4g} +/- {sd:.2g})"
    return format_cell(point["objectives"][i]) + spread


def _has_failed(point: Mapping[str, Any] | None) -> bool:
    return point is not None and bool(point["fresh"]["failed"])


def _failures(point: Mapping[str, Any] | None) -> str:
    """Return the number of fresh sets in which a design failed."""
    return "-" if point is None else f"{point['fresh']['failed']} of {point['fresh']['sets']}"


def _difference(point: Mapping[str, Any] | None, i: int) -> str:
    """Return the mean difference of an objective to the baseline with its standard error."""
    from railui.api.optimisation import is_significant

    if point is None:
        return "-"
    difference = point["fresh"]["minus_baseline"]
    mean, error, p_value = (difference[key][i] for key in ("mean", "standard_error", "p_value"))
    if mean is None or error is None:
        return "-"
    return f"{mean:.4g} +/- {error:.2g}" + ("" if is_significant(p_value) else ", not significant")


def _constraint(point: Mapping[str, Any] | None, i: int) -> str:
    """Return the value of a constrained key in the worst case, and in how many fresh sets the constraint is met."""
    if point is None:
        return "-"
    sets, met = point["fresh"]["sets"], point["fresh"]["met"][i]
    return format_cell(point["constraints"][i]) + (f" (met in {met} of {sets})" if met is not None else "")
