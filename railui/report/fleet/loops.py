"""Full loops on the runs of vehicles with alarms, each with its own report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from railui.campaign.campaign import Campaign, RunEntry
from railui.campaign.dataset import read_dataset
from railui.documents.saving import save_campaign, save_design
from railui.fleet.fleet_file import Fleet
from railui.fleet.status import TypeState
from railui.identification.loop import close_loop
from railui.io.problems import FileProblems
from railui.progress import Progress
from railui.report.loop.data import loop_report
from railui.report.loop.data_faults import data_fault_report, examine_data, write_data_fault
from railui.report.loop.files import write_loop

MAX_RUNS: Final = 4  # of a loop, the latest; the last one validates
MIN_RUNS: Final = 2
LOOPS: Final = "loops"
CAMPAIGN: Final = "campaign.yaml"


def run_loops(
    fleet: Fleet,
    states: Sequence[TypeState],
    directory: Path,
    count: int,
    seed: int,
    jobs: int | None,
    progress: Progress,
) -> dict[str, str]:
    """Run full loops on the latest alarms, one per vehicle, and return the reports of all loops by vehicle.

    The loop of an alarm is run once; its report stays where it is.

    Parameters
    ----------
    count
        Loops that are run now at most.
    """
    reports: dict[str, str] = {}
    latest = {alarm.vehicle: (state, alarm) for state in states for alarm in state.alarms}
    for vehicle, (state, alarm) in sorted(latest.items(), key=lambda item: -item[1][1].raised):
        files = [file for file in alarm.files if "://" not in file][-MAX_RUNS:]
        place = Path(LOOPS) / f"{vehicle}_{alarm.crossing.block:04d}"
        report = place / "loop" / "report.html"
        if not (directory / report).is_file():
            if count <= 0 or len(files) < MIN_RUNS or not all(Path(file).is_file() for file in files):
                continue
            count -= 1
            progress.message(f"{vehicle}: loop over its {len(files)} latest runs since the change began")
            try:
                run_loop(state.type.campaign, vehicle, files, directory / place, seed, jobs, progress)
            except (FileProblems, ValueError, ArithmeticError) as error:
                progress.message(f"{vehicle}: no loop, {error}")
                continue
        reports[vehicle] = str(report)
    return reports


def run_loop(
    campaign: Campaign, vehicle: str, files: Sequence[str], place: Path, seed: int, jobs: int | None, progress: Progress
) -> None:
    """Write the campaign of some runs of a vehicle, run its loop and write the report."""
    place.mkdir(parents=True, exist_ok=True)
    roles = ["adjust"] * (len(files) - 1) + ["validate"]
    entries = tuple(
        RunEntry(Path(f).resolve(), role, str(Path(f).resolve())) for f, role in zip(files, roles, strict=True)
    )
    campaign = replace(campaign, name=f"{vehicle} since its alarm", runs=entries, directory=place)
    save_design(campaign.design, place / "vehicle.yaml")
    save_campaign(campaign, place / CAMPAIGN, place / "vehicle.yaml")
    checked = examine_data(read_dataset(campaign), correct=False, accept_data=False, progress=progress)
    if checked.is_stopped:
        report = data_fault_report(checked, seed)
        write_data_fault(checked, report, place / "loop", [str(report["sentence"])])
        return
    result = close_loop(checked.dataset, seed=seed, jobs=jobs, progress=progress, diagnosis=checked.remaining)
    report = loop_report(result, checked)
    write_loop(result, report, place / "loop", [str(report["sentence"])])
