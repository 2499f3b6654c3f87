"""railui optimise: the search for better suspensions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli import VIOLATED
from railui.cli.common import Invocation, cell, options, refuse

if TYPE_CHECKING:
    from railui.execution.tasks import Runner
    from railui.optimisation.study import Study

SAMPLES = 256  # of Sobol's, for each of the variables and two more


@click.command("optimise")
@click.argument("study", metavar="STUDY")
@click.option(
    "-o", "--output", metavar="DIR", help="Where the result goes; railui-study/NAME beside the study by default."
)
@click.option("--scheduler", metavar="ADDRESS", help="Spread the work: tcp://host:8786 of a dask scheduler.")
@click.option("--choose", type=int, multiple=True, metavar="N", help="Write design N of the front as a design file.")
@click.option("--sensitivities", is_flag=True, help="Sobol's indices of the aims over the variables' ranges, too.")
@click.option("--unlock", is_flag=True, help="Take the directory over from a process that has ended elsewhere.")
@click.option("--dry-run", is_flag=True, help="Tell what would be searched, and stop.")
@options
@click.pass_context
def command(
    ctx: click.Context, study: str, output: str | None, scheduler: str | None, choose: tuple[int, ...],
    sensitivities: bool, unlock: bool, dry_run: bool, call: Invocation,
) -> None:  # fmt: skip
    """Search the variables of STUDY for better designs, whole generations side by side.

    Every evaluation is kept in DIR as it arrives: the same command resumes, and finds what it would have
    found. DIR gets the study and the vehicle as they were when it began, the result, the front, a report and
    the design at the knee. Exit code 4 where no design keeps the limits.
    """
    from railui.documents.recognise import expect
    from railui.execution.outputs import REPORT
    from railui.execution.session import Session
    from railui.optimisation.optimise import optimise
    from railui.optimisation.study import load_study
    from railui.report.search.page import write_study_page
    from railui.track import parse_spec

    expect(study, "study")
    told = load_study(study, check_track=parse_spec)
    call.warn(told.warnings)
    if call.seed is not None:
        told = replace(told, method=replace(told.method, seed=call.seed))
    where = Path(output) if output is not None else _usual(Path(study))
    if dry_run:
        _plan(told, where, call)
        return
    with Session(told, where, _runner(scheduler, call), unlock=unlock, say=call.say) as session:
        found = optimise(
            told,
            jobs=call.jobs,
            report=call.progress,
            evaluator=session.evaluator,
            watch=session.watch,
            samples=SAMPLES if sensitivities else 0,
        )
        call.warn(found["warnings"])
        inputs = [study, *([str(told.design.source)] if told.design.source else []), *_files(told)]
        document = call.document("optimise", found, inputs, told.method.seed)
        written = [*session.finish(document, choose), write_study_page(told, document, where / REPORT)]
    call.show(_table(found))
    call.say(f"wrote {', '.join(str(path) for path in written)}")
    call.emit(document)
    if found["knee"] is None:
        call.say(f"no design keeps the limits; the nearest: {found['closest']}")
        ctx.exit(VIOLATED)


def _usual(source: Path) -> Path:
    """The directory of a study: its own where it is the frozen one of a search, else one beside it."""
    from railui.execution.cache import FILE
    from railui.execution.outputs import STUDY

    if source.name == STUDY and (source.parent / FILE).is_file():
        return source.parent
    return source.parent / "railui-study" / source.stem


def _runner(scheduler: str | None, call: Invocation) -> Runner:
    if scheduler is None:
        from railui.execution.threads import ThreadRunner

        return ThreadRunner(call.jobs)
    try:
        from railui.execution.dask_cluster import DaskRunner
    except ModuleNotFoundError as error:
        raise refuse(f"--scheduler needs {error.name}: pip install 'railui[cluster]'") from None
    return DaskRunner(scheduler, call.say)


def _plan(study: Study, where: Path, call: Invocation) -> None:
    from railui.execution.outputs import check_directory
    from railui.optimisation.optimise import FRESH, checked_cases

    check_directory(study, where)
    cases = checked_cases(study)
    steps = sum(len(case.road.track) for case in cases)
    designs = study.method.population * study.method.generations
    told = f"{designs} designs by {study.method.kind} on {len(cases)} cases"
    told += f", {designs * steps / 1e9:.3g} thousand million steps, then the front on {FRESH} sets of fresh seeds"
    call.show(f"{told}; to {where}")
    body = {"study": study.name, "evaluations": designs, "cases": len(cases), "samples": designs * steps}
    call.emit(call.document("plan", body, [study.source], study.method.seed))


def _files(study: Study) -> list[str]:
    from railui.track.excitation import is_track_file

    beside = [study.directory / track for track in study.cases.track]
    return [str(path) for path in beside if is_track_file(path) and path.is_file()]


def _table(found: dict[str, Any]) -> Any:
    """Riding quality before and after, means over the cases, and the aims with their spread."""
    from rich.table import Table

    before, after = ((found["riding"][when] or {}) for when in ("before", "after"))
    title = f"{found['study']}: {len(found['pareto'])} designs on the front, {found['cases']} cases"
    table = Table("riding quality, mean of the cases", "before", "after (knee)", title=title, title_justify="left")
    for key in before or after:
        table.add_row(f"{key}, worst" if key == "class" else key, cell(before.get(key)), cell(after.get(key)))
    table.add_section()
    knee = found["pareto"][found["knee"]] if found["knee"] is not None else None
    for i, aim in enumerate(found["aims"]):
        cells = [_aim(point, i) for point in (found["baseline"], knee)]
        table.add_row(f"{aim['sense']} {aim['key']}, {aim['over']} (on fresh seeds)", *cells)
    for i, limit in enumerate(found["limits"]):
        cells = [cell(point["constraints"][i] if point else None) for point in (found["baseline"], knee)]
        table.add_row(limit, *cells)
    return table


def _aim(point: dict[str, Any] | None, i: int) -> str:
    if point is None:
        return "-"
    mean, sd = (point["fresh"][key][i] for key in ("mean", "sd"))
    spread = "" if mean is None or sd is None else f" ({mean:.4g} +/- {sd:.2g})"
    return cell(point["objectives"][i]) + spread
