"""Check of the runs that a fleet names: that they exist, can be read, and have the columns of their vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from railui.campaign.dataset import segments_of_run
from railui.documents.check import check_column_names
from railui.fleet.engine import summarised_files
from railui.fleet.fleet_file import Fleet
from railui.fleet.run_list import FleetRun, file_version, index_place
from railui.fleet.store import DATABASE, RESULTS, FleetStore
from railui.fleet.triggers import comparable_part
from railui.io.problems import FileProblems, Problem, unreadable_file
from railui.io.yaml_document import Document, load_yaml
from railui.progress import SILENT, Progress
from railui.runs.run import load_run

MAX_WARNINGS: Final = 3  # of one column over all runs, that are listed; the others are counted


@dataclass(frozen=True)
class RunReport:
    """Problems of a run; `has_part`: a part of it fulfils the triggers."""

    problems: list[Problem] = field(default_factory=list)
    has_part: bool = True


def run_problems(fleet: Fleet, runs: Sequence[FleetRun], progress: Progress = SILENT) -> list[Problem]:
    """Return the problems of the runs of a fleet, of which one at a time is in memory.

    Runs whose stored summary the next update uses are sound and not read again; of a remote run only the existence is
    checked. Threads would not read text faster.
    """
    done = _summarised(fleet, runs)
    unread = [run for run in runs if run.file not in done]
    document = load_yaml(fleet.source)
    errors: list[Problem] = []
    warnings: list[Problem] = []
    without_part: list[str] = []
    for number, run in enumerate(unread, 1):
        report = _check_run(fleet, document, run)
        for problem in report.problems:
            (errors if problem.severity == "error" else warnings).append(problem)
        if not report.has_part:
            without_part.append(run.file)
        progress.message(f"{number} of {len(unread)} runs checked")
    return [*errors, *_few_of_each_key(document, warnings), *_without_part(document, without_part, len(unread))]


def _summarised(fleet: Fleet, runs: Sequence[FleetRun]) -> set[str]:
    """Return the files with a summary in the directory of results; none where its store cannot be read."""
    directory = fleet.directory / RESULTS
    if not (directory / DATABASE).is_file():
        return set()
    try:
        store = FleetStore(directory, readonly=True)
    except OSError:
        return set()
    try:
        return summarised_files(fleet, store, runs)
    except OSError:
        return set()
    finally:
        store.close()


def _check_run(fleet: Fleet, document: Document, run: FleetRun) -> RunReport:
    """Read a run and report its problems."""
    form = fleet.vehicles[run.vehicle].type.campaign.design.run_form
    try:
        if "://" in run.file:
            file_version(run.file)
            return RunReport()
        Path(run.file).stat()
        loaded = load_run(run.file, form)
    except FileProblems as error:
        return RunReport(list(error.problems))
    except FileNotFoundError as error:
        return RunReport(_missing(fleet, run, error))
    except OSError as error:
        return RunReport(list(unreadable_file(run.file, error).problems))
    findings = document.findings()
    check_column_names(loaded, Path(run.file).name, findings)
    part = comparable_part(segments_of_run(loaded, run.file, "adjust", form), fleet.triggers, run.section)
    return RunReport([*loaded.warnings, *findings.problems], part is not None)


def _missing(fleet: Fleet, run: FleetRun, error: OSError) -> list[Problem]:
    """Return the problem of a run that does not exist, in its line of the table of runs."""
    if not run.line:
        return list(unreadable_file(run.file, error).problems)
    remedy = "correct the path, or leave the line out"
    return [Problem(index_place(fleet), run.line, 1, "file", f"{run.file} does not exist", remedy)]


def _few_of_each_key(document: Document, warnings: Sequence[Problem]) -> list[Problem]:
    """Return the first warnings of each column, and one that counts the others."""
    by_key: dict[str, list[Problem]] = {}
    for warning in warnings:
        by_key.setdefault(warning.key, []).append(warning)
    findings = document.findings()
    for key, same in by_key.items():
        findings.problems += same[:MAX_WARNINGS]
        if len(same) > MAX_WARNINGS:
            others = f"{len(same) - MAX_WARNINGS} more warnings of {key}, the last of {same[-1].file}"
            findings.warn("runs", others, "`railui check` of a run lists its own")
    return findings.problems


def _without_part(document: Document, files: Sequence[str], count: int) -> list[Problem]:
    """Warn of runs that an update leaves out because no part of them fulfils the triggers."""
    findings = document.findings()
    if files:
        some = f"{len(files)} of {count} runs have no part that fulfils them, such as {files[0]}"
        findings.warn("triggers", some, "widen speed, sections or min_duration, or leave the runs out")
    return findings.problems
