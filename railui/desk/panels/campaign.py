"""The Campaign panel: a vehicle adjusted to measured runs before one's eyes, what it lacks traced, the verdict."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Grid, Horizontal, Vertical
from textual.events import Resize
from textual.message import Message
from textual.widgets import Static

from railui.desk.axis import Axis
from railui.desk.bars import Bar, Bars
from railui.desk.dialogs import Name
from railui.desk.form import pretty, symbol
from railui.desk.loop_views import (
    Closed,
    error,
    force_picture,
    named,
    run_text,
    series_picture,
    share,
    short,
)
from railui.desk.messages import Done, Failed, Line, Offered, Showed
from railui.desk.panels.common import in_turn, titled
from railui.desk.plot import Picture, Plot
from railui.desk.work import Study
from railui.files.campaign import Campaign, load_campaign
from railui.files.display import display
from railui.files.parameters import PARAMETERS
from railui.files.problems import FileProblems
from railui.report.figures import compared_series, shown_channels, telling
from railui.report.laws import suspension_forces
from railui.report.loop import loop_report
from railui.report.loop_files import ForeignFiles, adjusted_design, check_directory, write_loop
from railui.study.confirm import Refit
from railui.study.judge import Floor
from railui.study.loop import Found, close_loop
from railui.study.measured import Measurement, read
from railui.study.model import Model
from railui.study.trace import Sighting, Trace, signed
from railui.study.watch import Judged, Looked, Turn

EMPTY = Picture(Axis(""), Axis(""), wait="after the verdict")
SHOWN = 60  # rows of the ranking
TALL = 30  # rows from which all pictures are shown
NARROW = 50  # columns below which an error stands alone
OFTEN = 0.1  # s between two pictures of a ranking that fills
FOLDED = {"moving": 3, "ranking": 0, "series": 1}  # which of them is shown where there is room for one


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
`ctrl+o` opens a campaign, `s` starts the loop: the declared vehicle is judged, adjusted by sixteen parallel models
(one as it is, the others each with one parameter a little changed), and what remains is traced to an effect that the
model lacks. **rho** is the correlation of the residual with what a parameter can do: at the optimum every bar is gone.
The ranking fills while candidates run beside the adjusted vehicle. The verdict stands for the runs that no fit has
seen. `p` pauses, `k` stops, `v` shows other pictures, `n` the next channel, `t` takes the adjusted design into
the form, `w` writes what `railui loop` writes.
"""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.source: Path | None = None
        self.campaign: Campaign | None = None
        self.study: Study | None = None
        self.closed: Closed | None = None
        self.view, self.channel = 0, 0
        self._forget()

    def _forget(self) -> None:
        """All that belongs to one loop."""
        self.errors: dict[str, Mapping[str, float]] = {}
        self.totals: dict[str, float] = {}
        self.turn: Turn | None = None
        self.seen: dict[Any, Sighting] = {}
        self.refits: dict[Any, float] = {}
        self.fitted: Model | None = None  # whose parameters are moving
        self.measurement: Measurement | None = None
        self.lines: list[str] = []
        self.drawn = 0.0  # when the ranking was drawn last
        self.doing = ""

    def compose(self) -> ComposeResult:
        yield Static(id="gate", classes="pane")
        with Horizontal(id="loop"):
            with Vertical(id="loop-left"):
                yield Bars("Error of the runs no fit has seen", "s starts the loop", id="errors")
                yield Bars("Parameters and rho", "", id="moving")
            with Grid(id="loop-right"):
                yield Bars("Parameters and rho", "", id="moving-right")
                yield Bars("Ranking", "what remains is traced after the adjustment", id="ranking")
                yield Plot(EMPTY, "Measured and simulated", id="series")
                yield Plot(EMPTY, "Force against motion", id="force")
        yield Static(id="verdict", classes="pane")

    def on_mount(self) -> None:
        self.query_one("#gate").border_title = "Campaign"
        self.query_one("#verdict").border_title = "Verdict"
        self._state()

    # the campaign

    def open(self, path: Path) -> None:
        """Opens a campaign; FileProblems with every fault."""
        campaign = load_campaign(path)
        if self.study is not None:
            self.study.stop()
        self.source, self.campaign, self.closed = path, campaign, None
        self._forget()
        self._everything()

    def action_start(self) -> None:
        if self.campaign is None:
            self.notify("open a campaign first: ctrl+o")
            return
        if self.study is not None:
            self.notify("the loop is running: k stops it")
            return
        self._forget()
        self.closed = None
        campaign = self.campaign
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

        measurement = read(campaign)
        watch(measurement)
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
            self.doing = "stopping"
            self._state()

    # what the loop shows

    @on(Showed)
    def _event(self, message: Showed) -> None:
        event = message.event
        if isinstance(event, Judged):
            self.errors[event.which] = event.judgement.channels
            self.totals[event.which] = event.judgement.nrmse
            self._errors()
        elif isinstance(event, Floor):
            self.errors["floor"], self.totals["floor"] = event.channels, event.nrmse
            self._errors()
        elif isinstance(event, Turn):
            self.turn = event
            self.doing = f"adjusting, step {event.iteration}, {event.simulations} simulated vehicles"
            if event.iteration == 0:
                self._fold("moving")
            self._moving()
        elif isinstance(event, Looked):
            if event.done == 1:
                self.seen, self.refits = {}, {}
                self._fold("ranking")
            self.doing = f"tracing, {100 * event.done // event.total} % of the catalogue"
            for one in event.sightings:
                if one.candidate not in self.seen or signed(one) > signed(self.seen[one.candidate]):
                    self.seen[one.candidate] = one
            if event.done == event.total or time.monotonic() - self.drawn > OFTEN:
                self._ranking()
        elif isinstance(event, Sighting):
            self.doing = f"fitting {named(event.candidate)}"
        elif isinstance(event, Refit):
            self.refits[event.candidate], self.fitted = event.rss, event.fit.model
            self._ranking()
        elif isinstance(event, Trace):
            self.doing = "fitting the best candidates with everything else"
        elif isinstance(event, Measurement):
            self.doing = "judging the declared vehicle"
            self.measurement = event
            self._gate()
        self._state()

    @on(Line)
    def _line(self, message: Line) -> None:
        self.lines.append(message.text)
        self._state()

    @on(Done)
    def _done(self, message: Done) -> None:
        self.study, self.closed = None, message.result
        self.doing = ""
        found: Found = message.result.found
        self.errors["after"], self.totals["after"] = found.judged["after"].channels, found.judged["after"].nrmse
        self.errors["floor"], self.totals["floor"] = found.floor.channels, found.floor.nrmse
        self.view = FOLDED["series"]
        self._everything()

    @on(Failed)
    def _failed(self, message: Failed) -> None:
        self.study = None
        self.doing = "stopped" if message.stopped else message.text
        self._state()
        if not message.stopped:
            self.notify(message.text, severity="error", timeout=10)

    # drawing

    def _everything(self) -> None:
        self._gate()
        self._arrange()
        self._state()
        in_turn(self, [self._ranking, self._pictures])

    def _gate(self) -> None:
        """What the campaign holds, and what the data gate counted."""
        gate, campaign = self.query_one("#gate", Static), self.campaign
        if campaign is None:
            gate.update("No campaign. ctrl+o opens one: its directory or campaign.yaml.")
            return
        titled(gate, campaign.name)
        text = Text(no_wrap=True, overflow="ellipsis")
        for i, run in enumerate(campaign.runs):
            text.append(f"{run.name:20} {run.role:9}")
            if self.measurement is not None:
                text.append_text(run_text(self.measurement, i))
            text.append("\n")
        text.rstrip()
        gate.update(text)

    def _state(self) -> None:
        """What goes on, in the title below; the verdict where there is one."""
        study, verdict = self.study, self.query_one("#verdict", Static)
        if self.closed is not None:
            verdict.update(Text(str(self.closed.report["sentence"])), layout=False)
            titled(verdict, sub=f"{self.closed.found.seconds:.0f} s · t takes the design · w writes the report")
            return
        if study is None:
            verdict.update(Text(self.doing or "No verdict yet: s starts the loop.", "dim"), layout=False)
            titled(verdict, sub="")
            return
        text = Text(" ".join(self.lines[-1].split()) if self.lines else "reading the runs")
        verdict.update(text, layout=False)
        titled(verdict, sub=f"{'paused' if study.paused else self.doing} · {study.seconds:.0f} s")

    def _errors(self) -> None:
        """A row per channel: as it is now, pale what it was declared, the floor as a line."""
        declared = self.errors.get("declared", {})
        now = self.errors.get("after") or self.errors.get("before") or declared
        worst = max([1e-9, *(v for v in declared.values() if np.isfinite(v)), *(v for v in now.values())])
        worst = worst if np.isfinite(worst) else 1.0
        bars = self.query_one("#errors", Bars)
        narrow = bars.size.width < NARROW
        judged = [w for w in ("declared", "before", "after") if w in self.errors]

        def row(name: str, found: Mapping[str, float], strong: bool = False) -> Bar:
            path = " ▸ ".join(error(found[w]) for w in (judged[-1:] if narrow else judged))
            told = path + (f" ┃ {error(found['floor'])}" if "floor" in found else "")
            mark = found["floor"] / worst if "floor" in found else None
            return Bar(name, share(found[judged[-1]], worst), told, share(found["declared"], worst), mark, strong)

        rows = [row("all", self.totals, True)] if judged else []
        rows += [row(c, {w: e[c] for w, e in self.errors.items() if c in e}) for c in now]
        titled(bars, sub="declared ▸ before ▸ after ┃ floor" if judged else "")
        bars.show(rows)

    def _moving(self) -> None:
        """A row per parameter: its value, how far it moved, and rho as a bar that goes to zero."""
        turn, campaign = self.turn, self.campaign
        if turn is None or campaign is None:
            self._show_moving([])
            return
        rows, narrow = [], self.query_one("#errors").size.width < NARROW
        for path, value, rho in zip(turn.paths, turn.values, turn.rho, strict=True):
            unit = self._unit(path)
            declared = campaign.design.values.get(path)
            moved = f"{100 * (value / declared - 1):+.0f} %" if declared else ""
            told = f"{pretty(display(float(value), unit, 3)):>14} {moved:>7}"
            name = symbol(PARAMETERS[path].symbol) if narrow and path in PARAMETERS else short(path)
            rows.append(Bar(name, abs(float(rho)), told))
        self._show_moving(rows)

    def _show_moving(self, rows: list[Bar]) -> None:
        for name in ("#moving", "#moving-right"):
            bars = self.query_one(name, Bars)
            if bars.display or not rows:
                bars.show(rows)

    def _unit(self, path: str) -> str:
        """The unit of what a fit moves; of an effect that is on trial from the model that it is tried in."""
        if path in PARAMETERS:
            return PARAMETERS[path].unit
        try:
            return self.fitted.design.unit(path) if self.fitted is not None else "1"
        except FileProblems:
            return "1"  # a sensor's, or a point of a curve

    def _fold(self, name: str) -> None:
        """Shows what is happening where there is room for one picture only."""
        self.view = FOLDED[name]
        self._arrange()

    def _ranking(self) -> None:
        """Candidates by what they explain; after the verdict as the report ranks them."""
        if self.closed is not None:
            self._judged_ranking(self.closed.report["ranking"])
            return
        self.drawn = time.monotonic()
        ranked = sorted(self.seen.values(), key=lambda s: -signed(s))[:SHOWN]
        least = min(self.refits.values(), default=1.0)
        rows, narrow = [], self.query_one("#ranking").size.width < NARROW
        for one in ranked:
            rss = self.refits.get(one.candidate)
            told = f"{one.rho:+.3f}" + ("         " if rss is None else f"  x{min(rss / least, 999.9):6.2f}")
            best = rss is not None and rss <= least
            told = told[:6] if narrow else told
            rows.append(
                Bar(named(one.candidate, narrow), signed(one), told, strong=best, role="now" if rss else "base")
            )
        ranking = self.query_one("#ranking", Bars)
        ranking.show(rows)
        titled(ranking, sub="rho, misfit over the best" if self.refits else "rho" if rows else "")

    def _judged_ranking(self, ranked: list[dict[str, Any]]) -> None:
        rows = []
        for i, row in enumerate(ranked[:SHOWN]):
            which = f" {row['wheelset']}" if row["wheelset"] else ""
            place = f", {row['at'].replace('_', ' ')}{which}" if row["at"] else " added"
            name = ("nothing" if row["kind"] == "none" else row["kind"].replace("_", " ")) + place
            told = f"{row['rho']:+.3f} {row['nrmse']:.3f}" + (
                f" {100 * row['weight']:3.0f} %" if row["weight"] else "      "
            )
            role = "now" if row["refitted"] else "base"
            rows.append(Bar(name, abs(row["rho"]), told, strong=i == 0, role=role))
        ranking = self.query_one("#ranking", Bars)
        ranking.show(rows)
        titled(ranking, sub="rho, error, how often best")

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
        """One picture where there is room for one, all three where there is room."""
        grid = self.query_one("#loop-right", Grid)
        parts = [self.query_one(f"#{name}") for name in ("ranking", "series", "force")]
        tall = grid.size.height >= TALL
        self.query_one("#moving").display = tall
        self.query_one("#errors").styles.height = 11 if tall else "1fr"
        shown = parts if tall else [*parts, self.query_one("#moving-right")]
        for i, part in enumerate([*parts, self.query_one("#moving-right")]):
            part.display = i < len(parts) if tall else i == self.view % len(shown)
        grid.styles.grid_size_rows = len(parts) if tall else 1
        grid.styles.grid_size_columns = 1
        self._moving()
        self._errors()

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
            write_loop(closed.found, closed.report, directory, [*self.lines, str(closed.report["sentence"])])
            return Line("loop", f"written to {directory}")

        self.notify(f"writing {directory}")
        Study(self, "write", job)

    def action_copy(self) -> None:
        text = self.closed.report["sentence"] if self.closed else "\n".join(self.lines)
        self.app.copy_to_clipboard(str(text))
        self.notify("copied the verdict" if self.closed else "copied the lines so far", timeout=2)
