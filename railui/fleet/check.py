"""Check of a fleet file with its table of runs and the runs themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from railui.fleet.fleet_file import Fleet, load_fleet
from railui.fleet.run_check import run_problems
from railui.fleet.run_list import FleetRun, list_runs
from railui.io.problems import FileProblems, Findings, Problem
from railui.io.yaml_document import load_yaml
from railui.progress import SILENT, Progress

MAX_NAMES: Final = 3  # of files or vehicles in a warning


def check_fleet(path: str | Path, progress: Progress = SILENT) -> Fleet:
    """Read a fleet and its runs; its warnings name implausible values and vehicles without runs.

    Runs that are summarised in the directory of results, and have not changed since, are not read again.

    Raises
    ------
    FileProblems
        With every fault of the file, of its designs, of the table of runs, or of the runs.
    """
    fleet = load_fleet(path)
    problems: list[Problem] = []
    runs = list_runs(fleet, problems)
    problems += [*fleet.warnings, *_list_warnings(fleet, runs), *run_problems(fleet, runs, progress)]
    if any(problem.severity == "error" for problem in problems):
        raise FileProblems(problems)
    return replace(fleet, warnings=tuple(problems))


def with_warnings(fleet: Fleet, runs: Sequence[FleetRun]) -> Fleet:
    """Return a fleet with the warnings about its list of runs, and of missing files, which an update leaves out."""
    findings = load_yaml(fleet.source).findings()
    missing = [run.file for run in runs if "://" not in run.file and not Path(run.file).is_file()]
    if missing:
        count = "1 file is" if len(missing) == 1 else f"{len(missing)} files are"
        findings.warn("runs", f"{count} missing: {_names(missing)}", "correct the paths")
    return replace(fleet, warnings=(*fleet.warnings, *_list_warnings(fleet, runs), *findings.problems))


def _list_warnings(fleet: Fleet, runs: Sequence[FleetRun]) -> list[Problem]:
    """Return the warnings about the list of runs."""
    findings = load_yaml(fleet.source).findings()
    without = sorted(set(fleet.vehicles) - {run.vehicle for run in runs})
    if not runs:
        findings.warn("runs", "name no file", "correct the index or the pattern, or record the first runs")
    elif without:
        findings.warn("vehicles", f"no runs of {_names(without)}", "correct the names, or wait for their runs")
    _warn_of_few_blocks(fleet, runs, findings)
    return findings.problems


def _warn_of_few_blocks(fleet: Fleet, runs: Sequence[FleetRun], findings: Findings) -> None:
    """Warn where all runs lie in the blocks from which levels are learnt."""
    times = np.array([run.time for run in runs])
    settings = fleet.settings
    if len(times) < 2 or not np.ptp(times) > 0.0:
        return
    blocks = int(np.ptp(times) / settings.block_days) + 1
    if blocks <= settings.baseline_blocks:
        spacing = float(np.median(np.diff(np.unique(times))))
        message = f"{blocks} blocks of {settings.block_days:g} days, of which the first {settings.baseline_blocks}"
        remedy = f"wait for more runs, or shorten the blocks: `settings: {{block_days: {spacing:g}}}`"
        findings.warn("runs", f"lie in {message} are not tested", remedy)


def _names(names: list[str]) -> str:
    more = f" and {len(names) - MAX_NAMES} more" if len(names) > MAX_NAMES else ""
    return ", ".join(names[:MAX_NAMES]) + more
