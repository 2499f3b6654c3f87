"""The Campaign panel: a vehicle adjusted to measured runs before one's eyes, what it lacks traced, the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Grid, Horizontal, Vertical, VerticalScroll
from textual.events import Resize
from textual.message import Message
from textual.widgets import Static

from railui.campaign.campaign import Campaign, load_campaign
from railui.campaign.data_checks import check_data
from railui.campaign.dataset import Dataset, read_dataset
from railui.campaign.finding import Finding
from railui.desk.messages import Done, Failed, Line, Offered, Showed
from railui.desk.panels.common import in_turn, titled
from railui.desk.presenters.loop_progress import Progress
from railui.desk.presenters.loop_views import Closed, force_picture, run_text, series_picture
from railui.desk.presenters.loop_words import determined_text, gate_text, hunting_note, summary
from railui.desk.services.work import Latest, Study
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.dialogs import Name
from railui.desk.widgets.picture import Picture
from railui.desk.widgets.plot import Plot
from railui.identification.events import FitIteration, ScoreTestProgress
from railui.identification.loop import close_loop
from railui.report.loop.data import loop_report
from railui.report.loop.driven import suspension_forces
from railui.report.loop.figures import compared_series, shown_channels, telling
from railui.report.loop.files import ForeignFiles, adjusted_design, check_directory, write_loop

EMPTY = Picture(Axis(""), Axis(""), wait="after the verdict")
TALL = 30  # rows from which all pictures are shown
TALLEST = 38  # and from which what the motions determine stands below them
NARROW = 50  # columns below which an error stands alone
PARTS = ("ranking", "series", "force", "told")  # what the right side shows
FOLDED = {"ranking": 0, "series": 1, "told": 3, "moving": 4}  # which of them is shown where there is room for one


@dataclass(frozen=True, eq=False)
class Gated:
    """A campaign read, and what the gate found about its data."""

    measurement: Dataset
    findings: Sequence[Finding]


class CampaignPanel(Vertical):
    """Runs and their state above, errors and parameters on the left, ranking and pictures on the right."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("s", "start", "Start"),
        Binding("p", "pause", "Pause"),
        Binding("k", "stop", "Stop"),
        Binding("v", "view(1)", "View"),
        Binding("n", "channel(1)", "Channel"),
        Binding("t", "take", "Take design"),
        Binding("w", "write", "Write report"),
        Binding("c", "copy", "Copy", show=False),
    ]
    HELP = """
## Campaign
`ctrl+o` opens a campaign; its data pass the **gate**, which tells what is wrong with them before anything is fitted and
how much of each channel is not coherent with the track. `s` starts the loop: the declared vehicle is judged, adjusted
by sixteen parallel models (one as it is, the others each with one parameter a little changed), and what remains is
traced to an effect that the model lacks. **rho** is the correlation of the residual with what a parameter can do: at
the optimum every bar is gone. The ranking fills while candidates run beside the adjusted vehicle. The verdict stands
for the validation runs; with it stands what the motions determine of each parameter. `p` pauses, `k` stops,
`v` shows other parts, `n` the next channel, `t` takes the adjusted design into the form, `w` writes what
`railui loop` writes.
"""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.source: Path | None = None
        self.campaign: Campaign | None = None
        self.study: Study | None = None
        self.progress = Progress()
        self.view, self.channel = FOLDED["told"], 0
        self.latest = Latest(self, "gate")

    @property
    def closed(self) -> Closed | None:
        """The loop with its verdict."""
        return self.progress.closed

    def compose(self) -> ComposeResult:
        yield Static(id="gate", classes="pane")
        with Horizontal(id="loop"):
            with Vertical(id="loop-left"):
                yield Bars("Error of the validation runs", "s starts the loop", id="errors")
                yield Bars("Parameters and rho", "", id="moving")
            with Grid(id="loop-right"):
                yield Bars("Parameters and rho", "", id="moving-right")
                yield Bars("Ranking", "what remains is traced after the adjustment", id="ranking")
                yield Plot(EMPTY, "Measured and simulated", id="series")
                yield Plot(EMPTY, "Force against motion", id="force")
                with VerticalScroll(id="told", classes="pane"):
                    yield Static(id="told-text")
        yield Static(id="verdict", classes="pane")

    def on_mount(self) -> None:
        self.query_one("#gate").border_title = "Campaign"
        self.query_one("#verdict").border_title = "Verdict"
        self._state()

    # the campaign

    def open(self, path: Path) -> None:
        """Opens a campaign and sends its data through the gate; FileProblems with every fault."""
        campaign = load_campaign(path)
        if self.study is not None:
            self.study.stop()
        self.source, self.campaign = path, campaign
        self.progress, self.view = Progress(campaign), FOLDED["told"]
        self._everything()
        self.latest.ask(partial(_gated, campaign))

    def action_start(self) -> None:
        if self.campaign is None:
            self.notify("open a campaign first: ctrl+o")
            return
        if self.study is not None:
            self.notify("the loop is running: k stops it")
            return
        campaign, before = self.campaign, self.progress
        self.progress = Progress(campaign)
        self.progress.measurement, self.progress.findings = before.measurement, before.findings
        self.study = Study(self, "loop", lambda study: self._close(study, campaign))
        self._everything()

    def _close(self, study: Study, campaign: Campaign) -> Message:
        """The whole loop, in a thread."""

        def watch(event: object) -> None:
            study.checkpoint()
            self.post_message(Showed("loop", event))

        def report(text: str) -> None:
            study.checkpoint()
            self.post_message(Line("loop", text))

        measurement = read_dataset(campaign)
        found = close_loop(measurement, report=report, watch=watch)
        window = telling(found)
        series = compared_series(found, window.index)
        return Done("loop", Closed(found, loop_report(found), window, series, suspension_forces(found, window)))

    def action_pause(self) -> None:
        if self.study is not None:
            self.study.pause()
            self._state()

    def action_stop(self) -> None:
        if self.study is not None:
            self.study.stop()
            self.progress.doing = "stopping"
            self._state()

    # what the loop shows

    @on(Showed)
    def _event(self, message: Showed) -> None:
        event = message.event
        if isinstance(event, Gated):
            if event.measurement.campaign is self.campaign:
                self.progress.measurement, self.progress.findings = event.measurement, event.findings
                self._runs()
                self._told()
            return
        changed = self.progress.take(event)
        if isinstance(event, FitIteration) and event.iteration == 0:
            self._fold("moving")
        elif isinstance(event, ScoreTestProgress) and event.done == 1:
            self._fold("ranking")
        for name, draw in (("errors", self._errors), ("moving", self._moving), ("ranking", self._ranking)):
            if changed == name:
                draw()
        self._state()

    @on(Line)
    def _line(self, message: Line) -> None:
        self.progress.lines.append(message.text)
        self._state()

    @on(Done)
    def _done(self, message: Done) -> None:
        self.study = None
        self.progress.close(message.result)
        self.view = FOLDED["series"]
        self._everything()

    @on(Failed)
    def _failed(self, message: Failed) -> None:
        if message.name == "loop":
            self.study = None
        if message.name == "gate":
            self.progress.fault = message.text
            self._told()
        elif message.name == "loop":
            self.progress.doing = "stopped" if message.stopped else message.text
        self._state()
        if not message.stopped:
            self.notify(message.text, severity="error", timeout=10)

    # drawing

    def _everything(self) -> None:
        self._runs()
        self._arrange()
        self._state()
        in_turn(self, [self._told, self._ranking, self._pictures])

    def _runs(self) -> None:
        """What the campaign holds, and what was lost of each run."""
        runs, campaign, measurement = self.query_one("#gate", Static), self.campaign, self.progress.measurement
        if campaign is None:
            runs.update("No campaign. ctrl+o opens one: its directory or campaign.yaml.")
            return
        titled(runs, campaign.name)
        text = Text(no_wrap=True, overflow="ellipsis")
        for i, run in enumerate(campaign.runs):
            text.append(f"{run.name:20} {run.role:9}")
            if measurement is not None:
                text.append_text(run_text(measurement, i))
            text.append("\n")
        text.rstrip()
        runs.update(text)

    def _told(self) -> None:
        """Before the verdict what the gate found about the data, after it what they determine, then the gate again."""
        told, progress = self.query_one("#told"), self.progress
        if self.campaign is None:
            titled(told, "Data gate")
            return
        waiting = Text(progress.fault, "red") if progress.fault else Text("reading the runs", "dim")
        found = gate_text(progress.findings) if progress.measurement else waiting
        if progress.closed is not None:
            titled(told, "What the motions determine · data gate")
            found = determined_text(progress.closed.report).append("\n\n").append_text(found)
        else:
            serious = sum(f.serious for f in progress.findings)
            titled(told, f"Data gate: check {serious} first" if serious else "Data gate")
        self.query_one("#told-text", Static).update(found)

    def _state(self) -> None:
        """What goes on, in the title below; the verdict where there is one."""
        study, verdict = self.study, self.query_one("#verdict", Static)
        if self.closed is not None:
            report = self.closed.report
            verdict.update(Text(f"{report['sentence']} {hunting_note(report)}".strip()))
            titled(
                verdict,
                f"Verdict · {summary(report)}",
                f"{self.closed.found.seconds:.0f} s · t takes the design · w writes the report",
            )
            return
        if study is None:
            verdict.update(Text(self.progress.doing or "No verdict yet: s starts the loop.", "dim"), layout=False)
            titled(verdict, "Verdict", "")
            return
        text = Text(" ".join(self.progress.lines[-1].split()) if self.progress.lines else "reading the runs")
        verdict.update(text, layout=False)
        titled(verdict, "Verdict", f"{'paused' if study.paused else self.progress.doing} · {study.seconds:.0f} s")

    def _errors(self) -> None:
        bars = self.query_one("#errors", Bars)
        rows = self.progress.error_rows(self._narrow)
        titled(bars, sub="declared ▸ before ▸ after ┃ floor" if rows else "")
        bars.show(rows)

    def _moving(self) -> None:
        rows = self.progress.moving_rows(self._narrow)
        for name in ("#moving", "#moving-right"):
            bars = self.query_one(name, Bars)
            if bars.display or not rows:
                bars.show(rows)

    def _ranking(self) -> None:
        ranking = self.query_one("#ranking", Bars)
        ranking.show(self.progress.ranking_rows(ranking.size.width < NARROW))
        titled(ranking, sub=self.progress.ranked_by)

    @property
    def _narrow(self) -> bool:
        """Is there room for few words only?"""
        return self.query_one("#errors").size.width < NARROW

    def _fold(self, name: str) -> None:
        """Shows what is happening where there is room for one picture only."""
        self.view = FOLDED[name]
        self._arrange()

    def _pictures(self) -> None:
        closed = self.closed
        series, force = self.query_one("#series", Plot), self.query_one("#force", Plot)
        if closed is None:
            series.show(EMPTY)
            force.show(EMPTY)
            return
        channels = shown_channels(closed.window.stretch)
        channel = channels[self.channel % len(channels)]
        titled(series, f"{channel}: measured and simulated")
        series.show(series_picture(closed, channel))
        if closed.forces:
            titled(force, closed.forces[0].title)
        wait = "no effect at a suspension was added" if closed.found.outside is None else "see the report: w writes it"
        force.show(force_picture(closed.forces[0]) if closed.forces else Picture(Axis(""), Axis(""), wait=wait))

    # arranging

    def on_resize(self, event: Resize) -> None:
        self._arrange()

    def _arrange(self) -> None:
        """One part where there is room for one; else those that have something to tell, three at most."""
        grid = self.query_one("#loop-right", Grid)
        tall = grid.size.height >= TALL
        self.query_one("#loop-left").display = bool(self.study or self.progress.errors)
        self.query_one("#moving").display = tall
        self.query_one("#errors").styles.height = 11 if tall else "1fr"
        shown = self._shown(tall)
        for name in (*PARTS, "moving-right"):
            self.query_one(f"#{name}").display = name in shown
        grid.styles.grid_size_columns, grid.styles.grid_size_rows = 1, len(shown)
        self._moving()
        self._errors()

    def _shown(self, tall: bool) -> list[str]:
        """The parts of the right side that are shown."""
        if not tall:
            return [[*PARTS, "moving-right"][self.view % (len(PARTS) + 1)]]
        if self.closed is not None and self.query_one("#loop-right").size.height >= TALLEST:
            return list(PARTS)
        if self.closed is not None:  # all but one: the view tells which
            hidden = (self.view + len(PARTS) - FOLDED["series"] - 1) % len(PARTS)
            return [name for name in PARTS if name != PARTS[hidden]]
        return ["told"] if self.study is None else ["ranking", "told"]

    def action_view(self, by: int) -> None:
        self.view += by
        self._arrange()

    def action_channel(self, by: int) -> None:
        self.channel += by
        self._pictures()

    # what comes of it

    def action_take(self) -> None:
        if self.closed is None:
            self.notify("no verdict yet")
            return
        found = self.closed.found
        what = f"adjusted to {found.measurement.campaign.name}"
        self.post_message(Offered(what, design=adjusted_design(found), declared=found.measurement.campaign.design))

    def action_write(self) -> None:
        if self.closed is not None and self.campaign is not None:
            begin = str(self.campaign.source.parent / "railui-loop")
            self.app.push_screen(Name("Write the report to", begin), self._write)

    def _write(self, name: str | None) -> None:
        closed = self.closed
        if name is None or closed is None:
            return
        directory = Path(name).expanduser()
        try:
            check_directory(directory)
        except ForeignFiles as error:
            self.notify(str(error), severity="error")
            return

        def job(_: Study) -> Message:
            write_loop(closed.found, closed.report, directory, [*self.progress.lines, str(closed.report["sentence"])])
            return Line("loop", f"written to {directory}")

        self.notify(f"writing {directory}")
        Study(self, "write", job)

    def action_copy(self) -> None:
        text = self.closed.report["sentence"] if self.closed else "\n".join(self.progress.lines)
        self.app.copy_to_clipboard(str(text))
        self.notify("copied the verdict" if self.closed else "copied the lines so far", timeout=2)


def _gated(campaign: Campaign) -> Message:
    """The runs of a campaign, read, and what is wrong with them."""
    measurement = read_dataset(campaign)
    return Showed("gate", Gated(measurement, check_data(measurement)))
