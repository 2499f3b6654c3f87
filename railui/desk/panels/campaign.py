"""Campaign panel: data checks, calibration, detection of unmodelled effects, verdict."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.widgets import Static

from railui.campaign.campaign import Campaign, load_campaign
from railui.desk.messages import DesignOffered, JobDone, JobFailed, PartChanged, ProgressEvent, ProgressMessage
from railui.desk.panels.common import COPY, PAUSE, START, STOP, VIEW, JobPanel, Pane, set_titles
from railui.desk.panels.loop_view import LoopView
from railui.desk.presenters.loop_history import LoopHistory
from railui.desk.presenters.loop_plots import FinishedLoop
from railui.desk.presenters.loop_text import hunting_note, identifiability_summary, runs_text
from railui.desk.services.jobs import BackgroundJob, LatestJobRunner
from railui.desk.services.loop_job import DataChecked, StoppedLoop, check_campaign, run_loop, write_report
from railui.desk.services.verdict_file import StoredVerdict
from railui.desk.widgets.dialogs import InputDialog, QuestionDialog
from railui.identification.events import FitIteration, ScoreTestProgress
from railui.report.loop.files import ForeignFilesError, calibrated_design, check_directory


class CampaignPanel(JobPanel):
    """Runs and verdict across the panel, errors and parameters on the left, ranking and plots on the right."""

    BINDINGS: ClassVar[list[Any]] = [
        START,
        PAUSE,
        STOP,
        VIEW,
        Binding("n", "channel(1)", "Channel", tooltip="show the next channel"),
        Binding("t", "take", "Take design", tooltip="open the calibrated design in the form"),
        Binding("w", "write", "Write report"),
        COPY,
    ]
    HELP = """
## Campaign
`ctrl+o` opens a campaign and **checks its data**: faults to correct before fitting, and the fraction of each channel
that is not coherent with the track. `s` starts the loop: the nominal model is validated, its parameters are estimated
(output-error method, sixteen simulations at a time), and a score test searches the residual for unmodelled effects.
**rho** is the correlation of the residual with the sensitivity to a parameter; at the optimum every bar vanishes. The
ranking fills as candidates are tested. The verdict refers to the validation runs; its title counts the identifiable
parameters. `p` pauses, `k` stops, `v` changes the view, `n` shows the next channel, `t` opens the calibrated design in
the form, `w` writes the files of `railui loop`.
"""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.campaign: Campaign | None = None
        self.history = LoopHistory()
        self.is_written = False  # the verdict, by `w`
        self.check_runner = LatestJobRunner(self, "data checks")

    @property
    def finished(self) -> FinishedLoop | None:
        """Result of the loop, or None before its end."""
        return self.history.finished

    @property
    def loop_view(self) -> LoopView:
        """Errors, parameters, candidates, plots and data checks."""
        return self.query_one(LoopView)

    def compose(self) -> ComposeResult:
        yield Pane("Campaign", id="runs")
        yield LoopView(id="loop")
        yield Pane("Verdict", id="verdict")

    def on_mount(self) -> None:
        self._show_runs()
        self.show_status()

    # the loop

    def open(self, path: Path) -> None:
        """Open a campaign and check its data; raise FileProblems with every error."""
        campaign = load_campaign(path)
        if self.job is not None:
            self.job.stop()
        self.campaign = campaign
        self.history = LoopHistory(campaign)
        self.is_written = False
        self._show_all("details")
        self.check_runner.submit(partial(check_campaign, campaign))

    def can_start(self) -> bool:
        return self.campaign is not None

    def command_state(self) -> object:
        return super().command_state(), self.finished is not None

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action in ("take", "write", "channel"):
            return self.finished is not None
        return super().check_action(action, parameters)

    def action_start(self) -> None:
        if self.campaign is None:
            self.notify("open a campaign first: ctrl+o")
            return
        if self.job is not None:
            self.notify("the loop is running: k stops it")
            return
        self.unless_unwritten(self._start)

    def unless_unwritten(self, action: Callable[[], object]) -> None:
        """Run an action that replaces the verdict; if the verdict was not written, ask first."""
        if self.finished is None or self.is_written:
            action()
            return

        def on_answer(answer: str | None) -> None:
            if answer == "g":
                action()
            elif answer == "w":
                self.action_write()

        answers = {"c": "cancel", "w": "write the report of this verdict", "g": "go on: this verdict is lost"}
        name = self.campaign.name if self.campaign is not None else "the campaign"
        self.app.push_screen(QuestionDialog(f"The verdict of {name} was not written.", answers), on_answer)

    def _start(self) -> None:
        if self.campaign is None:
            return
        campaign, last = self.campaign, self.history
        self.is_written = False
        self.history = LoopHistory(campaign)
        self.history.dataset = last.dataset
        self.history.findings = last.findings
        self.job = BackgroundJob(self, "loop", lambda job: run_loop(job, campaign))
        self._show_all()

    @on(ProgressEvent)
    def _on_event(self, message: ProgressEvent) -> None:
        event = message.event
        if isinstance(event, DataChecked):
            self._on_data_checked(event)
            return
        changed = self.history.add_event(event)
        if isinstance(event, FitIteration) and event.iteration == 0:
            self.loop_view.show_part("parameters")
        elif isinstance(event, ScoreTestProgress) and event.done == 1:
            self.loop_view.show_part("ranking")
        self.loop_view.show_changed(changed)
        self.show_status()

    def _on_data_checked(self, event: DataChecked) -> None:
        if event.dataset.campaign is self.campaign:
            self.history.dataset = event.dataset
            self.history.findings = event.findings
            self._show_runs()
            self.loop_view.show_details()

    @on(ProgressMessage)
    def _on_line(self, message: ProgressMessage) -> None:
        if message.name == "write":
            self.is_written = True
            self.notify(message.text, timeout=6)
            return
        self.history.lines.append(message.text)
        self.show_status()

    @on(JobDone)
    def _on_done(self, message: JobDone) -> None:
        self.job = None
        if isinstance(message.result, StoppedLoop):
            self.history.activity = str(message.result.report["sentence"])
            self._show_all()
            return
        self.history.finish(message.result)
        self._show_all("series")
        self.post_message(PartChanged("verdict"))

    def stored_verdict(self) -> StoredVerdict | None:
        """Return the verdict with what its panes show; None before the verdict."""
        history = self.history
        if history.finished is None:
            return None
        return StoredVerdict(
            history.finished, list(history.lines), dict(history.errors), dict(history.totals), history.iteration,
            list(history.findings),
        )  # fmt: skip

    def restore(self, stored: StoredVerdict) -> None:
        """Show the verdict of an ended session."""
        dataset = stored.finished.result.dataset
        self.campaign = dataset.campaign
        self.history = history = LoopHistory(dataset.campaign)
        history.dataset, history.findings = dataset, stored.findings
        history.errors, history.totals = dict(stored.errors), dict(stored.totals)
        history.lines, history.iteration = list(stored.lines), stored.iteration
        history.finished = stored.finished
        self.is_written = False
        self._show_all("series")

    @on(JobFailed)
    def _on_failed(self, message: JobFailed) -> None:
        if message.name == "loop":
            self.job = None
            self.history.activity = "stopped" if message.is_stopped else message.text
        elif message.name == "data checks":
            self.history.read_error = message.text
            self.loop_view.show_details()
        self.show_status()
        if not message.is_stopped:
            self.notify(message.text, severity="error", timeout=10)

    # drawing

    def _show_all(self, part: str | None = None) -> None:
        self._show_runs()
        self.show_status()
        self.loop_view.show(self.history, self.job is not None, part)

    def _show_runs(self) -> None:
        runs = self.query_one("#runs", Static)
        if self.campaign is None:
            runs.update("No campaign. ctrl+o opens one: its directory or campaign.yaml.")
            return
        set_titles(runs, self.campaign.name)
        runs.update(runs_text(self.campaign, self.history.dataset))

    def show_status(self) -> None:
        """Show the activity, or the verdict after the loop."""
        self.update_commands()
        job, verdict = self.job, self.query_one("#verdict", Static)
        if self.finished is not None:
            report = self.finished.report
            verdict.update(Text(f"{report['sentence']} {hunting_note(report)}".strip()))
            keys = f"{self.finished.result.seconds:.0f} s · t takes the design · w writes the report"
            set_titles(verdict, f"Verdict · {identifiability_summary(report)}", keys)
            return
        if job is None:
            text = self.history.activity or "No verdict yet: s starts the loop."
            verdict.update(Text(text, "dim"), layout=False)
            set_titles(verdict, "Verdict", "")
            return
        lines = self.history.lines
        verdict.update(Text(" ".join(lines[-1].split()) if lines else "reading the runs"), layout=False)
        activity = "stopping" if job.is_stopping else "paused" if job.is_paused else self.history.activity
        set_titles(verdict, "Verdict", f"{activity} · {job.elapsed:.0f} s")

    def arrange_parts(self) -> None:
        """Arrange the view of the loop."""
        self.loop_view.arrange_parts()

    def action_view(self, by: int) -> None:
        self.loop_view.view += by
        self.arrange_parts()

    def action_channel(self, by: int) -> None:
        self.loop_view.show_channel(by)

    # results

    def action_take(self) -> None:
        if self.finished is None:
            self.notify("no verdict yet")
            return
        result = self.finished.result
        campaign = result.dataset.campaign
        nominal, design = campaign.design, calibrated_design(result)
        stem = nominal.source.stem if nominal.source is not None else "vehicle"
        new_path = campaign.source.with_name(f"{stem}_calibrated.yaml")
        self.post_message(DesignOffered(f"calibrated on {campaign.name}", design, nominal, new_path))

    def action_write(self) -> None:
        if self.finished is not None and self.campaign is not None:
            directory = str(self.campaign.source.parent / "railui-loop")
            self.app.push_screen(InputDialog("Write the report to", directory), self._write)

    def _write(self, name: str | None) -> None:
        finished = self.finished
        if name is None or finished is None:
            return
        directory = Path(name).expanduser()
        try:
            check_directory(directory)
        except ForeignFilesError as error:
            self.notify(str(error), severity="error")
            return
        self.notify(f"writing {directory}")
        lines = list(self.history.lines)
        BackgroundJob(self, "write", lambda job: write_report(finished, directory, lines))

    def action_copy(self) -> None:
        text = self.finished.report["sentence"] if self.finished else "\n".join(self.history.lines)
        self.app.copy_to_clipboard(str(text))
        self.notify("verdict copied" if self.finished else "messages copied", timeout=2)
