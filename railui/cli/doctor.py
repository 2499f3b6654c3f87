"""railui doctor: installation self-test against reference values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from railui.cli import EXIT_LIMIT_VIOLATED
from railui.cli.invocation import Invocation, common_options
from railui.cli.tables import format_cell, make_table


@click.command("doctor")
@click.option(
    "--reference",
    type=click.Path(exists=True, file_okay=False),
    metavar="DIR",
    help="Directory with en15302/ and profiles/, whose licences do not allow distribution.",
)
@common_options
@click.pass_context
def command(ctx: click.Context, reference: str | None, call: Invocation) -> None:
    """Run the installation self-test against reference values, each with its source, and test the machine.

    Some values are published, others were derived independently for this check.
    Eigenvalues, critical speeds, curves, contact, spectra and weightings; bitwise agreement of one SIMD lane with
    sixteen and of one thread with several. Exit code 4 where a check fails.
    """
    from railui.api.machine import self_test

    report = self_test(reference, jobs=call.jobs)
    call.show(_table(report))
    call.write_json(call.document("doctor", report))
    ctx.exit(0 if report["ok"] else EXIT_LIMIT_VIOLATED)


def _table(report: Mapping[str, Any]) -> Any:
    from rich.text import Text

    machine = report["machine"]
    title = f"SIMD {machine['simd']}, {machine['threads']} threads, Python {machine['python']}, {machine['platform']}"
    rows = []
    for check in report["checks"]:
        values = (format_cell(check[key], 7) for key in ("name", "expected", "got", "tolerance", "source"))
        rows.append(["ok" if check["ok"] else Text("FAILS", "bold red"), *values])
    failed = sum(not check["ok"] for check in report["checks"])
    skipped = [f"skipped: {check['name']}, {check['reason']}" for check in report["skipped"]]
    counts = f"{len(report['checks'])} checks, {failed} failed, {report['seconds']:.1f} s"
    columns = ("", "check", "expected", "got", "within", "source")
    return make_table(columns, rows, title=title, caption="\n".join([*skipped, counts]))
