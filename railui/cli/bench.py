"""railui bench: the standard job on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli.common import Invocation, options, refuse

if TYPE_CHECKING:
    from rich.table import Table


@click.command("bench")
@click.option("--repetitions", type=click.IntRange(min=1), default=5, show_default=True, help="The quickest counts.")
@click.option("--study", is_flag=True, help="What a search costs beside the kernel, instead.")
@click.option("--precision", is_flag=True, help="What a step is wrong by, per vehicle and kind of effect, instead.")
@click.option("--keep", metavar="FILE", help="Append the result to FILE, dated, and tell the change since the last.")
@options
def command(repetitions: int, study: bool, precision: bool, keep: str | None, call: Invocation) -> None:
    """Time the standard job, full and reduced: 64 bogies over 2 km of erri_b176_high at 40 m/s, and coaches there.

    Nanoseconds are those of one step of one design on one thread. Beside them: the share of the core's peak, what
    threads gain, what every effect, the comfort filters and a call of the kernel cost. With --study: generations of
    256 designs on 4 cases of 1 km, searched and stored, over the bare kernel for the same rides. With --precision:
    errors of e_1 with 1, 2, 4 and 8 steps per sample, at 40 m/s and a sample every 0.1 m.
    """
    if sum((study, precision, keep is not None)) > 1:
        raise refuse("give one of --study, --precision and --keep")
    if study:
        _overhead(call)
    elif precision:
        _precision(call)
    else:
        _standard(repetitions, keep, call)


def _standard(repetitions: int, keep: str | None, call: Invocation) -> None:
    from railui.bench.costs import costs
    from railui.bench.roofline import peak
    from railui.bench.standard_job import bench

    call.progress("running the standard job")
    found = bench(call.jobs, repetitions)
    found["peak"] = peak({job: found[job]["ns_per_design_step"] for job in ("full", "reduced")}, repetitions)
    call.progress("timing what its parts cost")
    found |= costs(call.jobs, repetitions)
    for part in (_jobs(found), _peak(found["peak"]), _scaling(found), _effects(found), _rest(found)):
        call.show(part)
    if keep is not None:
        _kept(Path(keep), found, call)
    call.emit(call.document("bench", found, seed=1))


def _jobs(found: dict[str, Any]) -> Table:
    from rich.table import Table

    from railui.bench.standard_job import as_rows

    title = f"{found['designs']} designs, {found['lanes']} lanes, SIMD {found['simd']}"
    threads = f"designs/s, {found['threads']} threads"
    table = Table("job", "ns per design-step", "designs/s, 1 thread", threads, title=title)
    for row in as_rows(found):
        table.add_row(*row)
    times = found["coach_to_bogie"]
    table.caption = f"a step of the coach of 17 degrees costs {times:.2f} times that of the full bogie"
    return table


def _scaling(found: dict[str, Any]) -> Table:
    from rich.table import Table

    table = Table("threads", "designs/s", "times one thread", title="full job, 500 m")
    for row in found["scaling"]:
        table.add_row(str(row["threads"]), f"{row['designs_per_second']:.0f}", f"{row['times_one']:.2f}")
    return table


def _effects(found: dict[str, Any]) -> Table:
    from rich.table import Table

    table = Table("effects", "ns per design-step", "over none", "steps", title="one effect each, 1 km, without comfort")
    for row in found["effects"]:
        ns, over = f"{row['ns_per_design_step']:.1f}", f"{row['over_none']:+.1f}"
        table.add_row(row["effects"], ns, over, str(row["steps"]))
    return table


def _peak(peak: dict[str, Any] | None) -> Table | str:
    from rich.table import Table

    if peak is None:
        return "no share of the core's peak without vector instructions"
    operations, roots = (1e-9 * peak[key] for key in ("operations_per_second", "roots_per_second"))
    title = f"of the core's peak: {operations:.1f} operations per ns, {roots:.2f} square roots"
    table = Table("job", "operations per design-step", "of peak", "square roots", "of theirs", title=title)
    for job in ("full", "reduced"):
        counts, shares = peak[job]["operations"], [peak[job][key] for key in ("share", "roots_share")]
        of_peak, of_theirs = (f"{100 * share:.0f} %" for share in shares)
        table.add_row(job, str(sum(counts.values())), of_peak, str(counts["roots"]), of_theirs)
    return table


def _rest(found: dict[str, Any]) -> str:
    alone = found["alone"]
    return (
        f"one design alone      {alone['full_ms']:6.2f} ms for 2 km, {alone['reduced_ms']:.2f} ms reduced\n"
        f"15 parameters         {alone['jacobian_of_15']:6.2f} times that, all their differences\n"
        f"comfort filters       {found['comfort_ns_per_design_step']:6.1f} ns per design-step\n"
        f"crossing into Python  {found['crossing_us_per_call']:6.1f} us per call\n"
        f"setting up            {found['setup_us_per_design']:6.1f} us per design"
    )


def _kept(file: Path, found: dict[str, Any], call: Invocation) -> None:
    from railui.bench.benchmark_log import change, keep

    numbers = {name: found[name]["ns_per_design_step"] for name in ("full", "reduced", "coach")}
    before = keep(file, "ns per design-step", numbers)
    if before is None:
        call.show(f"kept in {file}, the first of this machine there")
        return
    then = f"{before['date'][:16].replace('T', ' ')}, {before['commit'] or 'no commit'}"
    call.show("\n  ".join([f"ns per design-step, since {then}:", *change(numbers, before)]))


def _overhead(call: Invocation) -> None:
    from railui.bench.search_overhead import overhead

    call.progress("searching, and the bare kernel beside it")
    found = overhead(call.jobs)
    each = [1e3 * found[key] / found["generations"] for key in ("seconds", "kernel_seconds")]
    call.show(
        f"a generation of {found['designs']} designs on {found['cases']} cases of 1 km, {found['threads']} threads:\n"
        f"  searched and stored  {each[0]:7.1f} ms\n  bare kernel          {each[1]:7.1f} ms\n"
        f"  ratio                {found['ratio']:7.3f}"
    )
    call.emit(call.document("bench_study", found, seed=1))


def _precision(call: Invocation) -> None:
    from rich.table import Table

    from railui.bench.step_error import step_errors

    found = step_errors()
    counts = [f"{n} step" + ("s" if n > 1 else "") for n in found["steps"]]
    table = Table("vehicle", "effects", *counts, "taken", title="error of e_1 over its rms", title_justify="left")
    for row in found["rows"]:
        errors = ["diverges" if error is None else f"{error:.0e}" for error in row["errors"]]
        table.add_row(row["vehicle"], row["effects"], *errors, str(row["taken"]))
    call.show(table)
    call.emit(call.document("bench_precision", found, seed=1))
