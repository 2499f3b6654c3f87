"""railui bench: the standard job on this machine."""

from __future__ import annotations

import click

from railui.cli.common import Invocation, options


@click.command("bench")
@click.option("--repetitions", type=click.IntRange(min=1), default=5, show_default=True, help="The quickest counts.")
@options
def command(repetitions: int, call: Invocation) -> None:
    """Time the standard job, full and reduced: 64 bogies over 2 km of erri_b176_high at 40 m/s.

    Nanoseconds are those of one step of one design on one thread.
    """
    from rich.table import Table

    from railui.study.bench import bench, told

    call.progress("running the standard job")
    found = bench(call.jobs, repetitions)
    title = f"{found['designs']} designs, {found['lanes']} lanes, SIMD {found['simd']}"
    threads = f"designs/s, {found['threads']} threads"
    table = Table("job", "ns per design-step", "designs/s, 1 thread", threads, title=title)
    for row in told(found):
        table.add_row(*row)
    call.show(table)
    call.emit(call.document("bench", found, seed=1))
