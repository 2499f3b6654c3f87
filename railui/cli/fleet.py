"""railui fleet: many vehicles over months of runs, and changes found before they reach a limit."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli.cluster import connect
from railui.cli.invocation import Invocation, StatusLine, common_options, usage_error
from railui.cli.tables import make_table
from railui.io.extras import install_extra

if TYPE_CHECKING:
    from rich.table import Table


MAX_REASONS = 5  # why runs are left out, that are printed


@click.group("fleet", context_settings={"help_option_names": ["-h", "--help"]})
def command() -> None:
    """Follow a fleet: new runs are tracked from the calibrated model of their vehicle, changes raise alarms.

    \b
    railui fleet run fleet.yaml                 compute new runs, test all vehicles, write the page
    railui fleet status fleet.yaml --since 2026-06-01
    railui fleet export fleet.yaml -o parquet   results as Parquet by vehicle and month

    A vehicle has the verdict none, learning, parameter, effect, sensor, or outside: a change that neither a parameter
    nor an effect that is followed explains. The thresholds are computed for a stated rate of false alarms per vehicle
    and month.
    """


@command.command("run")
@click.argument("fleet_file", metavar="FLEET")
@click.option("-o", "--out", metavar="DIR", help="Directory of the results; railui-fleet next to the file by default.")
@click.option(
    "--scheduler", metavar="ADDRESS", help="Scheduler of a dask cluster; the threads of this machine by default."
)
@click.option("--loops", type=click.IntRange(0), default=0, help="Full loops on vehicles with alarms, at most so many.")
@common_options
def run(fleet_file: str, out: str | None, scheduler: str | None, loops: int, call: Invocation) -> None:
    """Compute the new runs of FLEET and test all vehicles.

    Writes fleet.json and the page fleet.html.

    What was computed is taken from fleet.sqlite in DIR, where every result is stored as it arrives: an interrupted
    command resumes. The results do not depend on the number of threads or workers.
    """
    from railui.api.fleet import DOCUMENT, PAGE, update_fleet
    from railui.fleet.pools import DaskPool

    cluster = None if scheduler is None else connect(scheduler, call)
    try:
        document = update_fleet(
            fleet_file,
            out,
            loops=loops,
            seed=call.seed,
            jobs=call.jobs,
            pool=None if cluster is None else DaskPool(cluster),
            progress=StatusLine(call),
            warn=call.warn,
        )
    finally:
        if cluster is not None:
            cluster.close()
    _show(call, document)
    call.info(f"wrote to {out or 'railui-fleet next to the file'}: {DOCUMENT}, {PAGE}, fleet.npz, fleet.sqlite")
    call.write_json(document)


@command.command("status")
@click.argument("fleet_file", metavar="FLEET")
@click.option("-o", "--out", metavar="DIR", help="Directory of the results; railui-fleet next to the file by default.")
@click.option("--since", metavar="DAY", help="Alarms raised on this day or later: a date, or the number of a day.")
@common_options
def status(fleet_file: str, out: str | None, since: str | None, call: Invocation) -> None:
    """Report the last results of `railui fleet run`.

    Vehicles, alarms and sections; nothing is computed.
    """
    from railui.api.fleet import fleet_status
    from railui.io.units import UnitError

    try:
        document = fleet_status(fleet_file, out, since)
    except UnitError as error:
        raise usage_error(f"--since: {error}") from None
    _show(call, document)
    call.write_json(document)


@command.command("export")
@click.argument("fleet_file", metavar="FLEET")
@click.option("-o", "--out", metavar="DIR", required=True, help="Directory of the Parquet files.")
@click.option("--results", metavar="DIR", help="Directory of the results; railui-fleet next to the file by default.")
@common_options
def export(fleet_file: str, out: str, results: str | None, call: Invocation) -> None:
    """Export the estimates of all runs as Parquet.

    Partitioned by vehicle and month; DuckDB and polars read it.
    """
    from railui.api.fleet import results_directory
    from railui.fleet.fleet_file import load_fleet
    from railui.fleet.parquet import export_parquet
    from railui.fleet.store import FleetStore

    fleet = load_fleet(fleet_file)
    store = FleetStore(results_directory(fleet.directory, results), readonly=True)
    try:
        files, rows = export_parquet(fleet, store, Path(out))
    except ImportError as error:
        raise usage_error(f"the export needs {error.name}: {install_extra('parquet')}") from None
    finally:
        store.close()
    call.show(f"{rows} rows in {files} files below {out}")
    call.write_json(call.document("fleet_export", {"directory": out, "files": files, "rows": rows}, [fleet.source]))


def _show(call: Invocation, document: Mapping[str, Any]) -> None:
    """Print the counts, the alarms and the sections."""
    runs, vehicles = document["runs"], document["vehicles"]
    waiting = f", {runs['waiting']} wait for a reference" if runs["waiting"] else ""
    call.show(f"{document['fleet']}: {len(vehicles)} vehicles, {runs['all']} runs{waiting}")
    for reason, count in list(runs["left_out"].items())[:MAX_REASONS]:
        call.show(f"left out: {count}, {reason}")
    if len(runs["left_out"]) > MAX_REASONS:
        call.show(f"left out for {len(runs['left_out']) - MAX_REASONS} other reasons: see fleet.json")
    verdicts = [row["verdict"] for row in vehicles]
    counted = ", ".join(f"{name} {verdicts.count(name)}" for name in sorted(set(verdicts)))
    rate = f"stated rate {document['false_alarms_per_vehicle_month']:g} false alarms per vehicle-month"
    call.show(f"verdicts: {counted or '-'}; {rate}")
    if document["alarms"]:
        call.show(_alarm_table(document))
    raised = [(row["section"], alarm) for row in document["sections"] for alarm in row["alarms"]]
    for section, alarm in raised:
        call.show(f"track: section {section} has changed, {alarm['raised']} ({', '.join(alarm['quantities'][:3])})")


def _alarm_table(document: Mapping[str, Any]) -> Table:
    from railui.report.fleet.alarm_texts import change_text, limit_day

    rows = []
    for a in document["alarms"]:
        onset = a["onset"]
        rows.append(
            (
                a["raised"],
                a["vehicle"],
                a["verdict"],
                a["quantity"],
                change_text(a),
                change_text(a, "total_change"),
                "-" if onset is None else onset["day"],
                limit_day(a["limit"]),
            )
        )
    return make_table(
        ("raised", "vehicle", "verdict", "quantity", "change", "in total", "onset", "limit reached"),
        rows,
        title="alarms",
    )
