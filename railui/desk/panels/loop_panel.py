"""Campaigns of the Campaign panel and their loops: one runs at a time, others wait."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from textual import on

from railui.api.events import FitIteration, ScoreTestProgress
from railui.campaign.campaign import Campaign, load_campaign
from railui.desk.messages import JobDone, JobFailed, PartChanged, ProgressEvent, ProgressMessage
from railui.desk.panels.common import JobPanel
from railui.desk.panels.correcting import DataCorrector
from railui.desk.presenters.campaign_list import CampaignEntry, LoopOptions
from railui.desk.presenters.loop_history import LoopHistory
from railui.desk.presenters.loop_plots import FinishedLoop
from railui.desk.services.jobs import BackgroundJob, LatestJobRunner
from railui.desk.services.loop_computation import StoppedLoop
from railui.desk.services.loop_job import DataChecked, DataUnreadable, ReportWritten, check_campaign, run_loop
from railui.desk.services.verdict_file import StoredVerdict
from railui.desk.widgets.dialogs import QuestionDialog


class LoopPanel(JobPanel):
    """Panel with campaigns and their loops.

    entries: all campaigns; entry: the one that is shown; running: the one whose loop runs.
    """

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.entries: list[CampaignEntry] = []
        self.entry: CampaignEntry | None = None
        self.running: CampaignEntry | None = None
        self.check_runner = LatestJobRunner(self, "data checks")
        self._no_history = LoopHistory()

    @property
    def campaign(self) -> Campaign | None:
        """Campaign that is shown."""
        return None if self.entry is None else self.entry.campaign

    @property
    def history(self) -> LoopHistory:
        """Loop of the campaign that is shown."""
        return self._no_history if self.entry is None else self.entry.history

    @property
    def finished(self) -> FinishedLoop | None:
        """Result of the loop that is shown, or None before its end."""
        return self.history.finished

    @property
    def is_written(self) -> bool:
        """True if the report of the verdict that is shown was written."""
        return self.entry is not None and self.entry.is_written

    @property
    def is_computing(self) -> bool:
        """True if the loop that is shown is running."""
        return self.entry is not None and self.entry is self.running

    # drawing, by the panel

    def show_entry(self, part: str | None = None) -> None:
        """Show the campaign of the list that was chosen, beginning with a part of its loop."""
        raise NotImplementedError

    def show_changed(self, changed: str, part: str | None = None) -> None:
        """Show the part of the loop that an event has changed."""
        raise NotImplementedError

    def show_list(self) -> None:
        """Show the table of the campaigns."""
        raise NotImplementedError

    # the list

    def open(self, path: Path) -> None:
        """Open a campaign and check its data; raise FileProblems with every error."""
        campaign = load_campaign(path)
        entry = CampaignEntry(campaign, LoopHistory(campaign))
        same = next((i for i, each in enumerate(self.entries) if each.path == entry.path), None)
        if same is None:
            self.entries.append(entry)
        else:
            if self.running is self.entries[same] and self.job is not None:
                self.job.stop()
            self.entries[same] = entry
        self.select(entry)

    def request_open(self, path: Path, open_path: Callable[[], object]) -> None:
        """Open a campaign by a function; ask first if that replaces a verdict that was not written."""
        source = path.resolve() / "campaign.yaml" if path.is_dir() else path.resolve()
        same = next((each for each in self.entries if each.path == source), None)
        self.unless_unwritten(same, open_path)

    def select(self, entry: CampaignEntry) -> None:
        """Show a campaign; check its data if that was not done."""
        self.entry = entry
        history = entry.history
        self.show_entry("series" if history.finished else "details")
        if history.dataset is None and not history.read_error and entry is not self.running:
            self.check_runner.submit(partial(check_campaign, entry.campaign))

    def unless_unwritten(self, entry: CampaignEntry | None, action: Callable[[], object]) -> None:
        """Run an action that replaces the verdict of a campaign; if it was not written, ask first."""
        if entry is None or not entry.is_at_risk:
            action()
            return

        def on_answer(answer: str | None) -> None:
            if answer == "g":
                action()
            elif answer == "w":
                self.write_report(entry)

        answers = {"c": "cancel", "w": "write the report of this verdict", "g": "go on: this verdict is lost"}
        question = f"The verdict of {entry.campaign.name} was not written."
        self.app.push_screen(QuestionDialog(question, answers), on_answer)

    def write_report(self, entry: CampaignEntry) -> None:
        """Ask for a directory and write the report of a verdict."""
        raise NotImplementedError

    # the loop

    def can_start(self) -> bool:
        return self.entry is not None and not self.is_computing and not self.entry.is_waiting

    def action_start(self) -> None:
        if self.entry is None:
            self.notify("open a campaign first: ctrl+o")
        elif self.is_computing:
            self.notify("the loop is running: k stops it")
        else:
            entry = self.entry
            self.unless_unwritten(entry, lambda: self.start(entry))

    def action_start_all(self) -> None:
        """Run the loop of every campaign without a verdict."""
        for entry in self.entries:
            entry.is_waiting = entry.history.finished is None and entry is not self.running
        self._start_waiting()

    def action_stop(self) -> None:
        for entry in self.entries:
            entry.is_waiting, entry.options = False, LoopOptions()
        super().action_stop()
        self.show_list()

    def start(
        self, entry: CampaignEntry, campaign: Campaign | None = None, *, correct: bool = False, accept: bool = False
    ) -> None:
        """Start the loop of a campaign, or note that it waits for the one that runs.

        Parameters
        ----------
        campaign
            Campaign with corrections that were chosen; by default as its file has it.
        correct, accept
            Make the corrections that the data decide; go on in spite of serious faults.
        """
        if self.job is not None:
            entry.is_waiting, entry.options = True, LoopOptions(campaign, correct, accept)
            self.show_list()
            return
        used, last = campaign or entry.campaign, entry.history
        entry.is_written = entry.is_waiting = False
        entry.options = LoopOptions()
        entry.history = LoopHistory(entry.campaign)
        entry.history.dataset, entry.history.findings = last.dataset, last.findings
        entry.history.diagnosis = last.diagnosis
        self.running = entry
        self.job = BackgroundJob(self, "loop", lambda job: run_loop(job, used, correct=correct, accept_data=accept))
        self.show_entry() if entry is self.entry else self.show_list()

    def _start_waiting(self) -> None:
        waiting = next((entry for entry in self.entries if entry.is_waiting), None)
        if self.job is None and waiting is not None:
            options = waiting.options
            self.start(waiting, options.campaign, correct=options.correct, accept=options.accept)
        self.show_list()

    # corrections

    def has_data_fault(self) -> bool:
        """True if the data of the campaign have a serious fault, and its loop does not run."""
        diagnosis = self.history.stopped.remaining if self.history.stopped else self.history.diagnosis
        return not self.is_computing and self.finished is None and diagnosis is not None and bool(diagnosis.serious)

    def action_correct(self) -> None:
        """Correct the faults of the data and start the loop; the files stay as they are."""
        entry, history = self.entry, self.history
        diagnosis = history.stopped.remaining if history.stopped else history.diagnosis
        if entry is not None and diagnosis is not None:
            campaign = history.stopped.dataset.campaign if history.stopped else entry.campaign
            DataCorrector(self.app, campaign, diagnosis, lambda c: self.start(entry, c, correct=True)).start()

    def action_accept_data(self) -> None:
        """Start the loop in spite of the faults of the data."""
        if self.entry is not None:
            self.start(self.entry, accept=True)

    # events

    @on(ProgressEvent)
    def _on_event(self, message: ProgressEvent) -> None:
        event, entry = message.event, self.running
        if isinstance(event, DataChecked | DataUnreadable):
            self._on_data_checked(event)
            return
        if entry is None:
            return
        changed = entry.history.add_event(event)
        part = None
        if isinstance(event, FitIteration) and event.iteration == 0:
            part = "parameters"
        elif isinstance(event, ScoreTestProgress) and event.done == 1:
            part = "ranking"
        if entry is self.entry:
            self.show_changed(changed, part)

    def _on_data_checked(self, event: DataChecked | DataUnreadable) -> None:
        entry = next((each for each in self.entries if each.campaign is event.campaign), None)
        if entry is None:
            return
        if isinstance(event, DataUnreadable):
            entry.history.read_error = event.text
            self.notify(event.text, severity="error", timeout=10)
        else:
            entry.history.dataset, entry.history.findings = event.dataset, event.findings
            entry.history.diagnosis = event.diagnosis
        if entry is self.entry:
            self.show_entry(None if self.is_computing else "details")

    @on(ProgressMessage)
    def _on_line(self, message: ProgressMessage) -> None:
        if self.running is not None:
            self.running.history.lines.append(message.text)
            self.show_status()

    @on(ReportWritten)
    def _on_written(self, message: ReportWritten) -> None:
        for entry in self.entries:
            if entry.history.finished is message.finished:  # it may be another one since, or none
                entry.is_written = True
        self.notify(message.text, timeout=6)

    @on(JobDone)
    def _on_done(self, message: JobDone) -> None:
        entry, self.job, self.running = self.running, None, None
        if entry is None:
            return
        if isinstance(message.result, StoppedLoop):
            entry.history.stopped = message.result.checked
            entry.history.activity = str(message.result.report["sentence"])
        else:
            entry.history.finish(message.result)
            entry.history.dataset = message.result.result.dataset
            self.post_message(PartChanged("verdict"))
        if entry is self.entry:
            self.show_entry("details" if entry.history.stopped else "series")
            self.show_verdict()
        self._start_waiting()

    def show_verdict(self) -> None:
        """Show the page of the verdict."""
        raise NotImplementedError

    @on(JobFailed)
    def _on_failed(self, message: JobFailed) -> None:
        if message.name == "loop":
            entry, self.job, self.running = self.running, None, None
            if entry is not None:
                entry.history.activity = "stopped" if message.is_stopped else message.text
            self._start_waiting()
        self.show_status()
        if not message.is_stopped:
            self.notify(message.text, severity="error", timeout=10)

    # storing

    def stored_verdicts(self) -> list[StoredVerdict]:
        """Return the verdicts with what their panes show."""
        return [stored for entry in self.entries if (stored := entry.stored_verdict()) is not None]

    def restore(self, stored: StoredVerdict) -> None:
        """Show the verdict of an ended session."""
        entry = CampaignEntry.restored(stored)
        self.entries = [each for each in self.entries if each.path != entry.path] + [entry]
        self.select(entry)
        self.show_verdict()
