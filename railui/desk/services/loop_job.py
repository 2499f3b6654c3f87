"""Jobs of the Campaign panel: read and check the data, run the loop, write its report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from textual.message import Message

from railui.campaign.campaign import Campaign
from railui.campaign.data_checks import check_data
from railui.campaign.dataset import Dataset, read_dataset
from railui.campaign.faults.diagnose import diagnose
from railui.campaign.faults.fault import Diagnosis
from railui.campaign.finding import Finding
from railui.desk.messages import JobDone, ProgressEvent, ProgressMessage
from railui.desk.presenters.loop_plots import FinishedLoop
from railui.desk.services.jobs import BackgroundJob, DeskProgress
from railui.identification.loop import close_loop
from railui.report.loop.data import loop_report
from railui.report.loop.data_faults import CheckedData, data_fault_report, examine_data
from railui.report.loop.figures import compared_series, most_informative_window
from railui.report.loop.files import write_loop
from railui.report.loop.force_evaluation import suspension_forces


@dataclass(frozen=True, eq=False)
class DataChecked:
    """Dataset of a campaign, the diagnosis of its faults and the findings of all data checks."""

    dataset: Dataset
    findings: Sequence[Finding]
    diagnosis: Diagnosis

    @property
    def campaign(self) -> Campaign:
        """Campaign of the data."""
        return self.dataset.campaign


@dataclass(frozen=True, eq=False)
class DataUnreadable:
    """Campaign whose runs cannot be read, and why."""

    campaign: Campaign
    text: str


@dataclass(frozen=True, eq=False)
class StoppedLoop:
    """Report of a loop that stopped at a data fault, before any fit, and the checked data."""

    report: dict[str, Any]
    checked: CheckedData


def check_campaign(campaign: Campaign) -> Message:
    """Read the runs of a campaign and check their data."""
    try:
        dataset = read_dataset(campaign)
    except (ValueError, OSError) as error:
        return ProgressEvent("data checks", DataUnreadable(campaign, str(error)))
    diagnosis = diagnose(dataset)
    return ProgressEvent("data checks", DataChecked(dataset, check_data(dataset, diagnosis), diagnosis))


def run_loop(job: BackgroundJob, campaign: Campaign, *, correct: bool = False, accept_data: bool = False) -> Message:
    """Run the loop on a campaign and prepare its report and plots; options as of `examine_data`."""
    checked = examine_data(read_dataset(campaign), correct=correct, accept_data=accept_data)
    if checked.is_stopped:
        return JobDone(job.name, StoppedLoop(data_fault_report(checked), checked))
    job.checkpoint()
    result = close_loop(checked.dataset, progress=DeskProgress(job), diagnosis=checked.remaining)
    window = most_informative_window(result)
    series = compared_series(result, window.index)
    report = loop_report(result, checked)
    return JobDone(job.name, FinishedLoop(result, report, window, series, suspension_forces(result, window)))


def write_report(finished: FinishedLoop, directory: Path, lines: Sequence[str]) -> Message:
    """Write the files of `railui loop` into a directory."""
    write_loop(finished.result, finished.report, directory, [*lines, str(finished.report["sentence"])])
    return ProgressMessage("write", f"written to {directory}")
