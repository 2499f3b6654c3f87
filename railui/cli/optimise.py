"""railui optimise: the search for better suspensions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli.common import Invocation, options

if TYPE_CHECKING:
    from railui.files.study import Study

INFEASIBLE = 4


@click.command("optimise")
@click.argument("study", metavar="STUDY")
@click.option(
    "-o", "--output", metavar="DIR", help="Where the result goes; railui-study/NAME beside the study by default."
)
@click.option("--dry-run", is_flag=True, help="Tell what would be searched, and stop.")
@options
@click.pass_context
def command(ctx: click.Context, study: str, output: str | None, dry_run: bool, call: Invocation) -> None:
    """Search the variables of STUDY for better designs, by NSGA-II over whole generations.

    Writes the study as resolved, the result and the design at the knee of the front to DIR. Exit code 4
    where no design keeps the limits.
    """
    from railui.files.study import load_study
    from railui.study.optimise import optimise
    from railui.study.outcome import check_directory, save_outcome
    from railui.track import parse_spec

    told = load_study(study, check_track=parse_spec)
    call.warn(told.warnings)
    if call.seed is not None:
        told = replace(told, method=replace(told.method, seed=call.seed))
    source = Path(study)
    where = check_directory(told, output or source.parent / "railui-study" / source.stem)
    if dry_run:
        _plan(told, call)
        return
    found = optimise(told, jobs=call.jobs, report=call.progress)
    call.warn(found["warnings"])
    inputs = [study, *([str(told.design.source)] if told.design.source else []), *_files(told)]
    document = call.document("optimise", found, inputs, told.method.seed)
    written = save_outcome(told, document, where)
    call.show(_table(found))
    call.say(f"wrote {', '.join(str(path) for path in written)}")
    call.emit(document)
    if found["knee"] is None:
        call.say(f"no design keeps the limits; the nearest: {found['closest']}")
        ctx.exit(INFEASIBLE)


def _plan(study: Study, call: Invocation) -> None:
    from railui.study.aims import check_aims
    from railui.study.cases import cases_of

    check_aims(study)
    cases = cases_of(study)
    steps = sum(len(case.road.track) for case in cases)
    designs = study.method.population * study.method.generations
    call.show(f"{designs} designs on {len(cases)} cases, {designs * steps / 1e9:.3g} thousand million steps")
    body = {"study": study.name, "evaluations": designs, "cases": len(cases), "samples": designs * steps}
    call.emit(call.document("plan", body, [study.source], study.method.seed))


def _files(study: Study) -> list[str]:
    from railui.study.road import is_track_file

    beside = [study.directory / track for track in study.cases.track]
    return [str(path) for path in beside if is_track_file(path) and path.is_file()]


def _table(found: dict[str, Any]) -> Any:
    """Riding quality before and after, means over the cases, and the aims with their spread."""
    from rich.table import Table

    before, after = ((found["riding"][when] or {}) for when in ("before", "after"))
    title = f"{found['study']}: {len(found['pareto'])} designs on the front, {found['cases']} cases"
    table = Table("riding quality, mean of the cases", "before", "after (knee)", title=title, title_justify="left")
    for key in before or after:
        table.add_row(f"{key}, worst" if key == "class" else key, _text(before.get(key)), _text(after.get(key)))
    table.add_section()
    knee = found["pareto"][found["knee"]] if found["knee"] is not None else None
    for i, aim in enumerate(found["aims"]):
        cells = [_aim(point, i) for point in (found["baseline"], knee)]
        table.add_row(f"{aim['sense']} {aim['key']}, {aim['over']} (on fresh seeds)", *cells)
    for i, limit in enumerate(found["limits"]):
        cells = [_text(point["constraints"][i] if point else None) for point in (found["baseline"], knee)]
        table.add_row(limit, *cells)
    return table


def _aim(point: dict[str, Any] | None, i: int) -> str:
    if point is None:
        return "-"
    mean, sd = (point["fresh"][key][i] for key in ("mean", "sd"))
    spread = "" if mean is None or sd is None else f" ({mean:.4g} +/- {sd:.2g})"
    return _text(point["objectives"][i]) + spread


def _text(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
