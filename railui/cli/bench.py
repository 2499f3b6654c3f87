"""railui bench: speed of the kernel on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli.invocation import Invocation, common_options, usage_error
from railui.cli.tables import make_table

if TYPE_CHECKING:
    from rich.table import Table

LOGGED_JOBS = ("full", "reduced", "coach")
STEP_TIME = "ns per vehicle time step"


@click.command("bench")
@click.option(
    "--repetitions",
    type=click.IntRange(min=1),
    default=5,
    show_default=True,
    help="Number of repetitions; the fastest counts.",
)
@click.option("--study", is_flag=True, help="Measure the overhead of an optimisation over the kernel instead.")
@click.option("--precision", is_flag=True, help="Measure the time-step error per vehicle and kind of effect instead.")
@click.option("--keep", metavar="FILE", help="Append the result to the log FILE and print the change since the last.")
@common_options
def command(repetitions: int, study: bool, precision: bool, keep: str | None, call: Invocation) -> None:
    """Time the standard job, full and reduced: 64 bogies, and coaches, on 2 km of erri_b176_high at 40 m/s.

    Times are those of one time step of one vehicle on one thread. Also measured: the share of the core's peak
    performance, thread scaling, the cost of each effect, of the comfort filters and of a call of the kernel, and the
    form of the kernel's equations that each bundled vehicle takes.
    With --study: generations of 256 designs on 4 cases of 1 km, with search and storage, against the bare kernel. With
    --precision: errors of e_1 with 1, 2, 4 and 8 steps per sample, at 40 m/s and a sample every 0.1 m.
    """
    if sum((study, precision, keep is not None)) > 1:
        raise usage_error("give one of --study, --precision and --keep")
    if study:
        _measure_overhead(call)
    elif precision:
        _measure_step_errors(call)
    else:
        _run_standard_job(repetitions, keep, call)


def _run_standard_job(repetitions: int, log: str | None, call: Invocation) -> None:
    from railui.api.machine import benchmark

    call.status("running the standard job and timing its parts")
    result = benchmark(repetitions, jobs=call.jobs)
    call.show(_jobs_table(result))
    call.show(_peak_table(result["peak"]))
    call.show(_scaling_table(result))
    call.show(_effects_table(result))
    call.show(make_table(("vehicle", "form of the kernel"), list(result["forms"].items()), title="bundled vehicles"))
    call.show(_other_costs(result))
    if log is not None:
        _append_to_log(Path(log), result, call)
    call.write_json(call.document("bench", result, seed=1))


def _jobs_table(result: dict[str, Any]) -> Table:
    from railui.bench.standard_job import as_rows

    return make_table(
        ("job", STEP_TIME, "designs/s, 1 thread", f"designs/s, {result['threads']} threads"),
        as_rows(result),
        title=f"{result['designs']} designs, {result['lanes']} lanes, SIMD {result['simd']}",
        caption=f"a step of the coach with 17 degrees of freedom takes {result['coach_to_bogie']:.2f} times as long as "
        "that of the full bogie",
    )


def _scaling_table(result: dict[str, Any]) -> Table:
    rows = [
        (row["threads"], f"{row['designs_per_second']:.0f}", f"{row['times_one']:.2f}") for row in result["scaling"]
    ]
    return make_table(("threads", "designs/s", "speed-up"), rows, title="full job, 500 m")


def _effects_table(result: dict[str, Any]) -> Table:
    rows = [
        (row["effects"], f"{row['ns_per_design_step']:.1f}", f"{row['over_none']:+.1f}", row["steps"])
        for row in result["effects"]
    ]
    columns = ("effects", STEP_TIME, "added by the effect", "steps per sample")
    return make_table(columns, rows, title="one effect each, 1 km, without comfort filters")


def _peak_table(peak: dict[str, Any] | None) -> Table | str:
    if peak is None:
        return "no share of the core's peak without vector instructions"
    operations, roots = (1e-9 * peak[key] for key in ("operations_per_second", "roots_per_second"))
    rows = []
    for job in ("full", "reduced"):
        counts = peak[job]["operations"]
        shares = [f"{100 * peak[job][key]:.0f} %" for key in ("share", "roots_share")]
        rows.append((job, sum(counts.values()), shares[0], counts["roots"], shares[1]))
    return make_table(
        ("job", "operations per step", "share of peak", "square roots per step", "share of their peak"),
        rows,
        title=f"peak of the core: {operations:.1f} operations per ns, {roots:.2f} square roots per ns",
    )


def _other_costs(result: dict[str, Any]) -> str:
    single = result["alone"]
    return (
        f"single design         {single['full_ms']:6.2f} ms for 2 km, {single['reduced_ms']:.2f} ms reduced\n"
        f"15 parameters         {single['jacobian_of_15']:6.2f} times that, for all finite differences\n"
        f"comfort filters       {result['comfort_ns_per_design_step']:6.1f} {STEP_TIME}\n"
        f"call from Python      {result['crossing_us_per_call']:6.1f} us per call\n"
        f"set-up                {result['setup_us_per_design']:6.1f} us per design"
    )


def _append_to_log(file: Path, result: dict[str, Any], call: Invocation) -> None:
    from railui.bench.benchmark_log import append, describe_changes

    times = {name: result[name]["ns_per_design_step"] for name in LOGGED_JOBS}
    previous = append(file, "ns per design-step", times)  # the key of entries in existing logs
    if previous is None:
        call.show(f"logged in {file}: first entry of this machine")
        return
    since = f"{previous['date'][:16].replace('T', ' ')}, {previous['commit'] or 'no commit'}"
    call.show("\n  ".join([f"{STEP_TIME}, since {since}:", *describe_changes(times, previous)]))


def _measure_overhead(call: Invocation) -> None:
    from railui.bench.search_overhead import measure_search_overhead

    call.status("running the optimisation and the bare kernel")
    result = measure_search_overhead(call.jobs)
    search, kernel = (1e3 * result[key] / result["generations"] for key in ("seconds", "kernel_seconds"))
    call.show(
        f"a generation of {result['designs']} designs on {result['cases']} cases of 1 km, "
        f"{result['threads']} threads:\n"
        f"  search and storage   {search:7.1f} ms\n  bare kernel          {kernel:7.1f} ms\n"
        f"  ratio                {result['ratio']:7.3f}"
    )
    call.write_json(call.document("bench_study", result, seed=1))


def _measure_step_errors(call: Invocation) -> None:
    from railui.bench.step_error import step_errors

    result = step_errors()
    counts = [f"{n} step" + ("s" if n > 1 else "") for n in result["steps"]]
    rows = []
    for row in result["rows"]:
        errors = ["diverges" if error is None else f"{error:.0e}" for error in row["errors"]]
        rows.append((row["vehicle"], row["effects"], *errors, row["taken"]))
    columns = ("vehicle", "effects", *counts, "steps used")
    call.show(make_table(columns, rows, title="time-step error of e_1 relative to its rms"))
    call.write_json(call.document("bench_precision", result, seed=1))
