"""Loop of the Campaign panel as a process of its own computes it, with the data of its plots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from railui.api.loop import run_loop
from railui.campaign.campaign import Campaign
from railui.desk.presenters.loop_events import reduced_event
from railui.desk.presenters.loop_plots import FinishedLoop
from railui.progress import Progress
from railui.report.loop.figures import compared_series, most_informative_window
from railui.report.loop.force_evaluation import suspension_forces

if TYPE_CHECKING:
    from railui.report.loop.data_faults import CheckedData


@dataclass(frozen=True, eq=False)
class StoppedLoop:
    """Report of a loop that stopped at a data fault, before any fit, and the checked data."""

    report: dict[str, Any]
    checked: CheckedData | None


class ReducedProgress(Progress):
    """Progress with reduced events."""

    def __init__(self, receiver: Progress) -> None:
        self.receiver = receiver

    def message(self, text: str) -> None:
        """Pass a line on."""
        self.receiver.message(text)

    def event(self, event: object) -> None:
        """Pass a reduced event on."""
        self.receiver.event(reduced_event(event))


def compute_loop(
    progress: Progress, campaign: Campaign, correct: bool, accept_data: bool
) -> FinishedLoop | StoppedLoop:
    """Run the loop on a campaign and prepare its plots; options as of `railui.loop`."""
    loop = run_loop(campaign, correct=correct, accept_data=accept_data, progress=ReducedProgress(progress))
    report, result = loop.to_dict(), loop.result
    if result is None:
        return StoppedLoop(report, loop.checked)
    window = most_informative_window(result)
    series = compared_series(result, window.index)
    return FinishedLoop(result, report, window, series, suspension_forces(result, window))
