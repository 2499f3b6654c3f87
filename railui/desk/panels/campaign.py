"""Campaign panel: data checks, calibration, detection of unmodelled effects, verdict, list of campaigns."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Final

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.widgets import ContentSwitcher, Static

from railui.desk.messages import DesignOffered
from railui.desk.panels.campaign_help import CAMPAIGN_HELP
from railui.desk.panels.common import COPY, PAUSE, START, STOP, VIEW, Pane, set_titles
from railui.desk.panels.loop_panel import LoopPanel
from railui.desk.panels.loop_view import LoopView
from railui.desk.panels.result_pages import ResultTabs
from railui.desk.panels.verdict_page import VerdictPage
from railui.desk.presenters.campaign_list import CampaignEntry, campaign_columns
from railui.desk.presenters.loop_text import identifiability_summary, multiple_shooting_note, runs_text
from railui.desk.presenters.verdict_rows import ranking_count
from railui.desk.services.jobs import BackgroundJob
from railui.desk.services.loop_job import write_report
from railui.desk.widgets.dialogs import InputDialog
from railui.desk.widgets.table import Table
from railui.report.loop.files import ForeignFilesError, calibrated_design, check_directory

LOOP, VERDICT, CAMPAIGNS = "loop", "verdict-page", "campaigns"
PAGES: Final = {LOOP: "Loop", VERDICT: "Verdict", CAMPAIGNS: "Campaigns"}


class CampaignPanel(LoopPanel):
    """Pages of a campaign: its loop, its verdict, the list of all campaigns."""

    BINDINGS: ClassVar[list[Any]] = [
        START,
        PAUSE,
        STOP,
        VIEW,
        Binding("right_square_bracket", "page(1)", "Page", tooltip="loop, verdict, list of campaigns"),
        Binding("left_square_bracket", "page(-1)", "Page back", show=False),
        Binding("f", "correct", "Correct data", tooltip="correct the faults of the data and start the loop"),
        Binding("G", "accept_data", "Go on", show=False, tooltip="start the loop in spite of faults of the data"),
        Binding("n", "channel(1)", "Channel", show=False, tooltip="show the next channel"),
        Binding("r", "ranking", "Ranking", tooltip="show the next of the rankings that are kept"),
        Binding("t", "take", "Take", tooltip="open the calibrated design in the form"),
        Binding("w", "write", "Report", tooltip="write the report"),
        Binding("enter", "open_entry", "Open", show=False, tooltip="open the campaign under the cursor"),
        Binding("S", "start_all", "Run all", show=False, tooltip="run the loop of every campaign without a verdict"),
        COPY,
    ]
    HELP = CAMPAIGN_HELP

    @property
    def loop_view(self) -> LoopView:
        """Errors, parameters, candidates, plots and data checks."""
        return self.query_one(LoopView)

    @property
    def verdict_page(self) -> VerdictPage:
        """Stages, verdict, rivals, next runs, rankings."""
        return self.query_one(VerdictPage)

    @property
    def page(self) -> str:
        """Name of the page that is shown."""
        return str(self.query_one(ContentSwitcher).current)

    def compose(self) -> ComposeResult:
        yield Pane("Campaign", id="runs")
        yield ResultTabs(PAGES, id="campaign-tabs")
        with ContentSwitcher(initial=LOOP, id="campaign-pages"):
            yield LoopView(id=LOOP)
            yield VerdictPage(id=VERDICT)
            yield Table("Campaigns", "ctrl+o opens a campaign", id=CAMPAIGNS)
        yield Pane("Verdict", id="verdict")

    def on_mount(self) -> None:
        self._show_runs()
        self.show_status()

    # pages

    def show_page(self, name: str) -> None:
        """Show a page."""
        self.screen.minimize()
        self.query_one(ContentSwitcher).current = name
        self.query_one("#runs").display = name == LOOP
        self.query_one("#verdict").display = name != VERDICT
        self.show_list()
        self.update_commands()
        self.call_after_refresh(self.arrange_parts)
        if name == CAMPAIGNS:
            self.query_one(f"#{CAMPAIGNS}").focus()

    def show_verdict(self) -> None:
        if self.page == LOOP:
            self.show_page(VERDICT)

    @on(ResultTabs.Chosen)
    def _on_page_chosen(self, event: ResultTabs.Chosen) -> None:
        self.show_page(event.page)

    def action_page(self, by: int) -> None:
        names = list(PAGES)
        self.show_page(names[(names.index(self.page) + by) % len(names)])

    # commands

    def command_state(self) -> object:
        finished = self.finished is not None
        states = (finished, self.has_data_fault(), self.page, len(self.entries), len(self.history.rankings))
        return super().command_state(), states

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action in ("take", "write", "channel"):
            return self.finished is not None
        if action in ("correct", "accept_data"):
            return self.has_data_fault()
        if action == "ranking":
            return self.page == VERDICT and ranking_count(self.history) > 1
        if action == "open_entry":
            return self.page == CAMPAIGNS and bool(self.entries)
        if action == "start_all":
            return len(self.entries) > 1 and self.job is None
        if action == "start":
            return self.can_start()
        return super().check_action(action, parameters)

    def action_open_entry(self) -> None:
        self.show_page(VERDICT if self.finished is not None else LOOP)

    @on(Table.RowSelected)
    def _on_row_selected(self, event: Table.RowSelected) -> None:
        event.stop()
        if self.entries and self.entry is not (entry := self.entries[event.index]):
            self.select(entry)

    def action_ranking(self) -> None:
        self.verdict_page.show_next_ranking()

    def action_view(self, by: int) -> None:
        view = self.verdict_page if self.page == VERDICT else self.loop_view
        view.view += by
        self.arrange_parts()

    def action_channel(self, by: int) -> None:
        self.loop_view.show_channel(by)

    # drawing

    def arrange_parts(self) -> None:
        """Arrange the page that is shown."""
        if self.page == VERDICT:
            self.verdict_page.arrange_parts()
        else:
            self.loop_view.arrange_parts()

    def show_entry(self, part: str | None = None) -> None:
        self._show_runs()
        self.show_status()
        self.loop_view.show(self.history, self.is_computing, part)
        self.verdict_page.show(self.history, self.is_computing)
        self.show_list()

    def show_changed(self, changed: str, part: str | None = None) -> None:
        if part is not None:
            self.loop_view.show_part(part)
        self.loop_view.show_changed(changed)
        self.verdict_page.show(self.history, self.is_computing)
        self.show_status()

    def show_list(self) -> None:
        table = self.query_one(f"#{CAMPAIGNS}", Table)
        table.show(campaign_columns(self.entries, self.running))
        if self.entry in self.entries:
            table.place(self.entries.index(self.entry))
        count = len(self.entries)
        status = f"{self.entries.index(self.entry) + 1} of {count}" if self.entry in self.entries and count > 1 else ""
        self.query_one(ResultTabs).show(self.page, status)

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
        verdict = self.query_one("#verdict", Static)
        if self.finished is not None:
            report = self.finished.report
            verdict.update(Text(f"{report['sentence']} {multiple_shooting_note(report)}".strip()))
            keys = f"{self.finished.result.seconds:.0f} s · t takes the design · w writes the report"
            set_titles(verdict, f"Verdict · {identifiability_summary(report)}", keys)
            return
        job = self.job if self.is_computing else None
        if job is None:
            text = self.history.activity or "No verdict yet: s starts the loop."
            keys = "f corrects the data and starts the loop · G goes on" if self.has_data_fault() else ""
            verdict.update(Text(text, "dim"), layout=False)
            set_titles(verdict, "Verdict", keys)
            return
        lines = self.history.lines
        verdict.update(Text(" ".join(lines[-1].split()) if lines else "reading the runs"), layout=False)
        activity = "stopping" if job.is_stopping else "paused" if job.is_paused else self.history.activity
        set_titles(verdict, "Verdict", f"{activity} · {job.elapsed:.0f} s")

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
        if self.entry is not None:
            self.write_report(self.entry)

    def write_report(self, entry: CampaignEntry) -> None:
        directory = str(entry.campaign.source.parent / "railui-loop")
        self.app.push_screen(InputDialog("Write the report to", directory), lambda name: self._write(entry, name))

    def _write(self, entry: CampaignEntry, name: str | None) -> None:
        finished = entry.history.finished
        if name is None or finished is None:
            return
        directory = Path(name).expanduser()
        try:
            check_directory(directory)
        except ForeignFilesError as error:
            self.notify(str(error), severity="error")
            return
        self.notify(f"writing {directory}")
        lines = list(entry.history.lines)
        BackgroundJob(self, "write", lambda job: write_report(finished, directory, lines))

    def action_copy(self) -> None:
        text = self.finished.report["sentence"] if self.finished else "\n".join(self.history.lines)
        self.app.copy_to_clipboard(str(text))
        self.notify("verdict copied" if self.finished else "messages copied", timeout=2)
