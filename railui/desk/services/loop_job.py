"""Jobs of the Campaign panel: read and check the data, run the loop, write its report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from textual.message import Message

from railui.api.campaign_data import examine_campaign
from railui.api.loop import Loop
from railui.campaign.campaign import Campaign
from railui.campaign.dataset import Dataset
from railui.campaign.faults.fault import Diagnosis
from railui.campaign.finding import Finding
from railui.desk.messages import JobDone, ProgressEvent
from railui.desk.presenters.loop_plots import FinishedLoop
from railui.desk.services.child_job import run_in_child
from railui.desk.services.jobs import BackgroundJob
from railui.desk.services.loop_computation import compute_loop


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


@dataclass
class ReportWritten(Message):
    """The report of a loop was written."""

    finished: FinishedLoop
    text: str


def check_campaign(campaign: Campaign) -> Message:
    """Read the runs of a campaign and check their data."""
    try:
        examined = examine_campaign(campaign)
    except (ValueError, OSError) as error:
        return ProgressEvent("data checks", DataUnreadable(campaign, str(error)))
    return ProgressEvent("data checks", DataChecked(*examined))


def run_loop(job: BackgroundJob, campaign: Campaign, *, correct: bool = False, accept_data: bool = False) -> Message:
    """Run the loop on a campaign in a process of its own; options as of `railui.loop`."""
    return JobDone(job.name, run_in_child(job, compute_loop, campaign, correct, accept_data))


def write_report(finished: FinishedLoop, directory: Path, lines: Sequence[str]) -> Message:
    """Write the files of `railui loop` into a directory."""
    Loop(finished.report, None, finished.result).save(directory, lines)
    return ReportWritten(finished, f"written to {directory}")
