"""The Capture panel: a serial logger recorded, its channels on a strip chart, what was lost, instants marked."""

from __future__ import annotations

from contextlib import ExitStack
from datetime import datetime
from pathlib import Path
from typing import Any, ClassVar

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Grid, Horizontal, Vertical
from textual.events import Resize
from textual.message import Message
from textual.widgets import Static

from railui.capture.protocol.load import BAUDS, NARROW
from railui.capture.recorder.record import Recorder
from railui.capture.simulator.demo_logger import DemoLogger
from railui.desk.messages import Done, Failed, Showed
from railui.desk.messages import Line as Told
from railui.desk.panels.common import arranged, titled
from railui.desk.services.ports import DEMO, ports
from railui.desk.services.tap import WINDOW, State, Tap, state_of
from railui.desk.services.work import Study
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.bars import Bar, Bars
from railui.desk.widgets.dialogs import Name, Pick
from railui.desk.widgets.picture import Level, Line, Picture
from railui.desk.widgets.plot import Plot
from railui.io.number_format import unit_text

CHARTS = 6
EMPTY = Picture(Axis(""), Axis(""), wait="s starts recording")


class CapturePanel(Vertical):
    """The port and its counters on the left, the strip chart on the right."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("s", "start", "Record"),
        Binding("k", "stop", "Stop"),
        Binding("m", "mark", "Mark"),
        Binding("o", "port", "Port"),
        Binding("r", "baud", "Baud"),
        Binding("v", "view(1)", "Channels"),
        Binding("c", "copy", "Copy", show=False),
    ]
    HELP = """
## Capture
`o` chooses a port (or the **demo** logger, a simulated vehicle in a process of its own), `r` the baud rate, `s`
records: raw bytes go to the disk first, the decoded runs beside them. The bars show how much of the line is used and
what was lost: frames by their numbers, samples by their times. `m` marks the instant with a word, `k` ends cleanly.
`railui capture campaign` makes a campaign of recordings.
"""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.port, self.baud = DEMO, 115200
        self.study: Study | None = None
        self.recorder: Recorder | None = None
        self.directory: Path | None = None
        self.state: State | None = None
        self.view = 0
        self.lines: list[str] = []

    def compose(self) -> ComposeResult:
        with Horizontal():
            with Vertical(id="capture-left"):
                yield Static(id="port", classes="pane")
                yield Bars("Line and losses", "nothing recorded yet", id="losses")
                yield Bars("Channels", "", id="channels", cursor=True)
            with Grid(id="strips"):
                for i in range(CHARTS):
                    yield Plot(EMPTY, f"channel {i + 1}", id=f"strip{i}")

    def on_mount(self) -> None:
        self.query_one("#port").border_title = "Port"
        self._told()

    # choosing

    def action_port(self) -> None:
        self.app.push_screen(Pick("Which port?", ports(), free=True), self._port)

    def _port(self, name: str | None) -> None:
        if name is not None:
            self.port = name
            self._told()

    def action_baud(self) -> None:
        choices = [(str(b), f"{b} baud") for b in BAUDS]
        self.app.push_screen(Pick("How many bits a second?", choices), self._baud)

    def _baud(self, name: str | None) -> None:
        if name is not None:
            self.baud = int(name)
            self._told()

    # recording

    def action_start(self) -> None:
        if self.study is not None:
            self.notify("it records already: k stops it")
            return
        self.directory = Path("railui-capture") / datetime.now().strftime("%Y-%m-%d_%H%M%S")
        self.state, self.lines = None, []
        port, baud, directory = self.port, self.baud, self.directory
        self.study = Study(self, "capture", lambda job: self._record(job, port, baud, directory))
        self._told()

    def _record(self, job: Study, port: str, baud: int, directory: Path) -> Message:
        """Records until it is stopped, in a thread."""
        with ExitStack() as stack:
            device = stack.enter_context(DemoLogger()).port if port == DEMO else port
            recorder = Recorder(device, baud, directory, lambda text: self._say(text))
            self.recorder, tap = recorder, Tap()
            recorder.replay.watch = tap.take
            for replay in recorder.run():
                if job.stopping.is_set():
                    recorder.stop()
                self.post_message(Showed("capture", state_of(replay, tap, baud)))
            self.recorder = None
        return Done("capture", recorder.replay.report())

    def _say(self, text: str) -> None:
        self.post_message(Told("capture", text))

    def action_stop(self) -> None:
        if self.study is not None:
            self.study.stop()
            self._told()

    def action_mark(self) -> None:
        if self.recorder is not None:
            self.app.push_screen(Name("Mark this instant as"), self._marked)

    def _marked(self, word: str | None) -> None:
        if word is not None and self.recorder is not None:
            self.recorder.marker(word)
            self.notify(f"marked: {word}", timeout=2)

    @on(Showed)
    def _showed(self, message: Showed) -> None:
        self.state = message.event
        self._told()
        self._losses()
        self._strips()

    @on(Told)
    def _line(self, message: Told) -> None:
        self.lines.append(message.text)
        self._told()

    @on(Done)
    def _done(self, message: Done) -> None:
        self.study = None
        report = message.result
        self.lines.append(f"written to {self.directory}: {report['samples']} samples, {report['lost']} frames lost")
        for note in report["notes"]:
            self.notify(note, severity="warning")
        self._told()

    @on(Failed)
    def _failed(self, message: Failed) -> None:
        self.study = self.recorder = None
        self.lines.append(message.text)
        self.notify(message.text, severity="error", timeout=10)
        self._told()

    # drawing

    def _told(self) -> None:
        """The port, what goes on, the last line that was told."""
        text = Text(no_wrap=True, overflow="ellipsis")
        text.append(f"{self.port}, {self.baud} baud\n", "bold")
        state = self.state
        if self.study is None:
            text.append("o port, r baud, s records\n", "dim")
        elif state is None:
            text.append("opening the port\n")
        else:
            text.append(f"{state.device or 'listening'}, {state.seconds:.1f} s\n")
        text.append(self.lines[-1] if self.lines else "", "yellow" if self.lines else "dim")
        pane = self.query_one("#port", Static)
        pane.update(text, layout=False)
        titled(pane, sub="recording" if self.study is not None else "")

    def _losses(self) -> None:
        state = self.state
        if state is None:
            return
        rows = []
        if state.load is not None:
            used = f"{100 * state.load:.0f} % used"
            rows.append(Bar("line", state.load, used, mark=NARROW, strong=state.load > NARROW))
        total = max(1, state.counts["samples"])
        for name in ("samples", "frames", "lost", "missing", "crc errors", "gaps", "reconnects", "overruns", "queue"):
            bad = name not in ("samples", "frames", "queue") and state.counts[name] > 0
            share = state.counts[name] / total if name in ("lost", "missing", "crc errors") else 0.0
            rows.append(Bar(name, share, f"{state.counts[name]}", strong=bad))
        rows += [Bar(name, 0.0, f"{value:.4g}") for name, value in state.status.items() if value is not None]
        self.query_one("#losses", Bars).show(rows)
        channels = []
        for i, (name, unit) in enumerate(zip(state.names, state.units, strict=True)):
            x = state.values[:, i]
            told = f"{x[-1]:10.4g} ± {x.std():.3g} {unit_text(unit)}" if len(x) else unit_text(unit)
            channels.append(Bar(name, 0.0, told))
        self.query_one("#channels", Bars).show(channels)
        titled(self.query_one("#channels"), sub=f"{state.rate:.4g} Hz")

    def _strips(self) -> None:
        """The last seconds of as many channels as there is room for, one strip after the other."""
        state = self.state
        if state is None or not state.names:
            return
        for i in range(CHARTS):
            plot = self.query_one(f"#strip{i}", Plot)
            if not plot.display:
                continue
            k = (self.view + i) % len(state.names)
            titled(plot, state.names[k])
            x = Axis("t", "s", low=state.t[-1] - WINDOW, high=float(state.t[-1])) if len(state.t) else Axis("t", "s")
            marks = [Level(t, word, upright=True) for t, word in state.marks]
            plot.show(
                Picture(x, Axis(state.names[k], unit_text(state.units[k])), [Line(state.t, state.values[:, k])], marks)
            )

    def on_resize(self, event: Resize) -> None:
        self._arrange()

    def _arrange(self) -> None:
        arranged(self.query_one("#strips", Grid), [self.query_one(f"#strip{i}") for i in range(CHARTS)], 0)
        self._strips()

    def action_view(self, by: int) -> None:
        shown = sum(1 for i in range(CHARTS) if self.query_one(f"#strip{i}").display)
        self.view += by * shown
        self._strips()

    def action_copy(self) -> None:
        self.query_one("#losses", Bars).action_copy()
