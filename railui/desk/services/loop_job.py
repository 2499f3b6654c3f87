"""Jobs of the Campaign panel: read and check the data, run the loop, write its report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from textual.message import Message

from railui.api.campaign_data import examine_campaign
from railui.api.loop import Loop
from railui.api.loop import run_loop as compute_loop
from railui.campaign.campaign import Campaign
from railui.campaign.dataset import Dataset
from railui.campaign.faults.fault import Diagnosis
from railui.campaign.finding import Finding
from railui.desk.messages import JobDone, ProgressEvent, ProgressMessage
from railui.desk.presenters.loop_plots import FinishedLoop
from railui.desk.services.jobs import BackgroundJob, DeskProgress
from railui.report.loop.figures import compared_series, most_informative_window
from railui.report.loop.force_evaluation import suspension_forces

if TYPE_CHECKING:
    from railui.report.loop.data_faults import CheckedData


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
    checked: CheckedData | None


def check_campaign(campaign: Campaign) -> Message:
    """Read the runs of a campaign and check their data."""
    try:
        examined = examine_campaign(campaign)
    except (ValueError, OSError) as error:
        return ProgressEvent("data checks", DataUnreadable(campaign, str(error)))
    return ProgressEvent("data checks", DataChecked(*examined))


def run_loop(job: BackgroundJob, campaign: Campaign, *, correct: bool = False, accept_data: bool = False) -> Message:
    """Run the loop on a campaign and prepare its plots; options as of `railui.loop`."""
    loop = compute_loop(campaign, correct=correct, accept_data=accept_data, progress=DeskProgress(job))
    report, result = loop.to_dict(), loop.result
    if result is None:
        return JobDone(job.name, StoppedLoop(report, loop.checked))
    window = most_informative_window(result)
    series = compared_series(result, window.index)
    return JobDone(job.name, FinishedLoop(result, report, window, series, suspension_forces(result, window)))


def write_report(finished: FinishedLoop, directory: Path, lines: Sequence[str]) -> Message:
    """Write the files of `railui loop` into a directory."""
    Loop(finished.report, None, finished.result).save(directory, lines)
    return ProgressMessage("write", f"written to {directory}")
