"""Fleets: compute new runs and test all vehicles, or read what was found last."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from railui.api.document import json_document
from railui.progress import SILENT, Progress

if TYPE_CHECKING:
    from railui.fleet.block_means import BlockMeans
    from railui.fleet.engine import Update
    from railui.parallel import Pool

DOCUMENT: Final = "fleet.json"
PAGE: Final = "fleet.html"


def update_fleet(
    fleet: str | Path,
    out: str | Path | None = None,
    *,
    loops: int = 0,
    seed: int | None = None,
    jobs: int | None = None,
    pool: Pool | None = None,
    progress: Progress = SILENT,
    warn: Callable[[Sequence[Any]], None] | None = None,
) -> dict[str, Any]:
    """Compute new runs of a fleet, test all vehicles and write the results, as `railui fleet run`.

    Parameters
    ----------
    fleet : str or Path
        File of the fleet, or its directory.
    out : str or Path, optional
        Directory of the results; railui-fleet next to the file by default.
    loops : int
        Full loops on vehicles with alarms, at most so many.
    seed : int, optional
        Seed of the loops.
    jobs : int, optional
        Threads; by default all.
    pool : Pool, optional
        Where the runs are computed, in place of threads.
    progress : Progress
        Receiver of messages.
    warn : callable, optional
        Receives the warnings of the file.

    Returns
    -------
    dict
        The keys of railui.fleet/1, documented in docs/results.md.

    Raises
    ------
    FileProblems
        For a faulty file.
    OSError
        For results that cannot be written.
    """
    from railui.execution.lock import Lock
    from railui.fleet.block_means import BLOCK_MEANS, write_block_means
    from railui.fleet.check import with_warnings
    from railui.fleet.engine import update_fleet as compute
    from railui.fleet.fleet_file import load_fleet
    from railui.fleet.pools import ThreadPool
    from railui.fleet.run_list import list_runs
    from railui.fleet.status import assess_fleet, block_means, fleet_document
    from railui.fleet.store import FleetStore
    from railui.io.atomic import check_directory_writable, write_text
    from railui.report.fleet.loops import run_loops
    from railui.report.fleet.page import write_fleet_page

    loaded = load_fleet(fleet)
    runs = list_runs(loaded)
    loaded = with_warnings(loaded, runs)
    if warn is not None:
        warn(loaded.warnings)
    directory = results_directory(loaded.directory, out)
    check_directory_writable(directory)
    directory.mkdir(parents=True, exist_ok=True)
    lock = Lock(directory)
    store = FleetStore(directory)
    try:
        update = compute(loaded, store, pool or ThreadPool(jobs), progress, runs)
        progress.message("testing the vehicles")
        states = assess_fleet(loaded, store)
        reports = run_loops(loaded, states, directory, loops, seed or 0, jobs, progress)
        found = fleet_document(loaded, states, reports)
        store.replace_alarms(found["alarms"])
        body = {"runs": _counts(update), **found}
        document = json_document("fleet", body, [loaded.source], seed)
        write_text(directory / DOCUMENT, json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n")
        write_block_means([block_means(state) for state in states], directory / BLOCK_MEANS)
        write_fleet_page(loaded, document, states, directory / PAGE)
    finally:
        store.close()
        lock.release()
    return document


def fleet_status(fleet: str | Path, out: str | Path | None = None, since: str | None = None) -> dict[str, Any]:
    """Return vehicles, alarms and sections as they were found last, as `railui fleet status`; nothing is computed.

    Parameters
    ----------
    fleet, out
        As for `update_fleet`.
    since : str, optional
        Day; only alarms raised on it or later.

    Raises
    ------
    FileProblems
        Where there are no results.
    ValueError
        For a faulty day.
    """
    from railui.fleet.schema import read_time
    from railui.io.problems import file_problem

    file = _results_of(fleet, out) / DOCUMENT
    if not file.is_file() and not Path(fleet).exists():
        raise file_problem(fleet, "does not exist", "name a fleet.yaml, or its directory")
    if not file.is_file():
        raise file_problem(file, "does not exist", f"run `railui fleet run {fleet}` first")
    document: dict[str, Any] = json.loads(file.read_text("utf-8"))
    if since is not None:
        first = read_time(since)
        _check_kind_of_day(since, document)
        document["alarms"] = [row for row in document["alarms"] if read_time(row["raised"]) >= first]
        for section in document["sections"]:
            section["alarms"] = [row for row in section["alarms"] if read_time(row["raised"]) >= first]
    return document


def _check_kind_of_day(since: str, document: dict[str, Any]) -> None:
    """Raise UnitError for a date where the fleet numbers its days, and for a number where it has dates."""
    from railui.io.units import UnitError

    times = [row["last_run"] for row in document["vehicles"]] + [row["raised"] for row in document["alarms"]]
    known = next((time for time in times if time is not None), None)
    if known is not None and _is_number(known) != _is_number(since):
        kind, remedy = ("numbers of days", "a number such as") if _is_number(known) else ("dates", "a date such as")
        raise UnitError(f"{since!r} is none of the days of this fleet, which has {kind}", f"write {remedy} {known}")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def fleet_block_means(fleet: str | Path, out: str | Path | None = None) -> list[BlockMeans]:
    """Return the block means of every vehicle type as they were found last: measured, expected, sums of the tests.

    Parameters
    ----------
    fleet, out
        As for `update_fleet`.

    Raises
    ------
    FileProblems
        Where there are no results, or damaged ones.
    """
    from railui.fleet.block_means import BLOCK_MEANS, read_block_means

    return read_block_means(_results_of(fleet, out) / BLOCK_MEANS)


def _results_of(fleet: str | Path, out: str | Path | None) -> Path:
    source = Path(fleet)
    return results_directory(source if source.is_dir() else source.parent, out)


def results_directory(home: Path, out: str | Path | None) -> Path:
    """Return the directory of the results of a fleet."""
    from railui.fleet.store import RESULTS

    return Path(out) if out is not None else home / RESULTS


def _counts(update: Update) -> dict[str, Any]:
    reasons = list(update.left_out.values())
    return {
        "all": update.runs,
        "computed": update.computed,
        "stored": update.stored,
        "waiting": sum(update.waiting.values()),
        "left_out": {reason: reasons.count(reason) for reason in sorted(set(reasons))},
    }
