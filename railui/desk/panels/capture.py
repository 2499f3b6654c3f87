"""Capture panel: recording of a serial logger with strip charts, losses and markers."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Any, ClassVar

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Grid, Horizontal, Vertical
from textual.message import Message
from textual.widgets import Static

from railui.capture.protocol.load import BAUD_RATES
from railui.desk.messages import JobDone, JobFailed, ProgressEvent, ProgressMessage
from railui.desk.panels.common import COPY, STOP, JobPanel, Pane, arrange_grid, set_titles
from railui.desk.presenters.choices import DEMO_PORT, port_choices
from railui.desk.presenters.recording_text import channel_rows, link_rows, strip_plot
from railui.desk.services.jobs import BackgroundJob
from railui.desk.services.recording import DeskRecording, RecordingStatus
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.dialogs import ChoiceDialog, InputDialog
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.plot_data import PlotData

MAX_CHARTS = 6
DEFAULT_BAUD_RATE = 115200
NO_PLOT = PlotData(Axis(""), Axis(""), placeholder="s starts recording")


class CapturePanel(JobPanel):
    """Port and counters on the left, strip charts on the right."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("s", "start", "Record"),
        STOP,
        Binding("m", "mark", "Mark"),
        Binding("o", "port", "Port"),
        Binding("r", "baud", "Baud"),
        Binding("v", "view(1)", "Channels"),
        COPY,
    ]
    HELP = """
## Capture
`o` chooses a serial port (or the **demo** logger, a simulated vehicle in a separate process), `r` the baud rate. `s`
records: raw bytes are written to the disk first, decoded runs next to them. The bars show the load of the serial link
and the losses: frames by their numbers, samples by their times. `m` marks the current instant with a label, `k` ends
the recording. `railui capture campaign` builds a campaign from recordings.
"""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.port = DEMO_PORT
        self.baud = DEFAULT_BAUD_RATE
        self.recording: DeskRecording | None = None
        self.directory: Path | None = None
        self.status: RecordingStatus | None = None
        self.lines: list[str] = []

    def compose(self) -> ComposeResult:
        with Horizontal():
            with Vertical(id="capture-left"):
                yield Pane("Port", id="port")
                yield Bars("Link and losses", "nothing recorded yet", id="losses")
                yield Bars("Channels", "", id="channels", has_cursor=True)
            with Grid(id="strips"):
                for i in range(MAX_CHARTS):
                    yield Plot(NO_PLOT, f"channel {i + 1}", id=f"strip{i}")

    def on_mount(self) -> None:
        self.show_status()

    # port

    def action_port(self) -> None:
        self.app.push_screen(ChoiceDialog("Port", port_choices(), free=True), self._set_port)

    def _set_port(self, name: str | None) -> None:
        if name is not None:
            self.port = name
            self.show_status()

    def action_baud(self) -> None:
        choices = [(str(rate), f"{rate} baud") for rate in BAUD_RATES]
        self.app.push_screen(ChoiceDialog("Baud rate", choices), self._set_baud)

    def _set_baud(self, rate: str | None) -> None:
        if rate is not None:
            self.baud = int(rate)
            self.show_status()

    # recording

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "mark":
            return self.job is not None
        if action in ("port", "baud"):
            return self.job is None
        return super().check_action(action, parameters)

    def action_start(self) -> None:
        if self.job is not None:
            self.notify("a recording is running: k stops it")
            return
        self.directory = Path("railui-capture") / datetime.now().strftime("%Y-%m-%d_%H%M%S")
        self.status = None
        self.lines = []
        recording = DeskRecording(self.port, self.baud, self.directory, self._post_line)
        self.recording = recording
        self.job = BackgroundJob(self, "capture", lambda job: self._record(job, recording))
        self.show_status()

    def _record(self, job: BackgroundJob, recording: DeskRecording) -> Message:
        for status in recording.run(job.stop_requested):
            self.post_message(ProgressEvent(job.name, status))
        return JobDone(job.name, recording.report)

    def _post_line(self, text: str) -> None:
        self.post_message(ProgressMessage("capture", text))

    def action_mark(self) -> None:
        if self.recording is not None and self.recording.recorder is not None:
            self.app.push_screen(InputDialog("Label of the marker"), self._add_marker)

    def _add_marker(self, label: str | None) -> None:
        if label is not None and self.recording is not None and self.recording.recorder is not None:
            self.recording.recorder.add_marker(label)
            self.notify(f"marked: {label}", timeout=2)

    @on(ProgressEvent)
    def _on_status(self, message: ProgressEvent) -> None:
        self.status = message.event
        self.show_status()
        self._show_losses()
        self._show_strips()

    @on(ProgressMessage)
    def _on_line(self, message: ProgressMessage) -> None:
        self.lines.append(message.text)
        self.show_status()

    @on(JobDone)
    def _on_done(self, message: JobDone) -> None:
        self.job = None
        report = message.result
        self.lines.append(f"written to {self.directory}: {report['samples']} samples, {report['lost']} frames lost")
        for note in report["notes"]:
            self.notify(note, severity="warning")
        self.show_status()

    @on(JobFailed)
    def _on_failed(self, message: JobFailed) -> None:
        self.job = None
        self.recording = None
        self.lines.append(message.text)
        self.notify(message.text, severity="error", timeout=10)
        self.show_status()

    # drawing

    def show_status(self) -> None:
        """Show the port, the state of the recording, and its last message."""
        text = Text(no_wrap=True, overflow="ellipsis")
        text.append(f"{self.port}, {self.baud} baud\n", "bold")
        status = self.status
        if self.job is None:
            text.append("o port, r baud, s records\n", "dim")
        elif status is None:
            text.append("opening the port\n")
        else:
            text.append(f"{status.device or 'waiting for data'}, {status.seconds:.1f} s\n")
        text.append(self.lines[-1] if self.lines else "", "yellow")
        pane = self.query_one("#port", Static)
        pane.update(text, layout=False)
        set_titles(pane, sub="recording" if self.job is not None else "")
        self.update_commands()

    def _show_losses(self) -> None:
        if self.status is None:
            return
        self.query_one("#losses", Bars).show(link_rows(self.status))
        channels = self.query_one("#channels", Bars)
        channels.show(channel_rows(self.status))
        set_titles(channels, sub=f"{self.status.rate:.4g} Hz")

    def _show_strips(self) -> None:
        """Draw the last seconds of as many channels as fit."""
        status = self.status
        if status is None or not status.names:
            return
        for i in range(MAX_CHARTS):
            plot = self.query_one(f"#strip{i}", Plot)
            if plot.display:
                channel = (self.view + i) % len(status.names)
                set_titles(plot, status.names[channel])
                plot.show(strip_plot(status, channel))

    def arrange_parts(self) -> None:
        """Show as many strip charts as fit."""
        arrange_grid(self.query_one("#strips", Grid), [self.query_one(f"#strip{i}") for i in range(MAX_CHARTS)], 0)
        self._show_strips()

    def action_view(self, by: int) -> None:
        """Show the next channels."""
        self.view += by * sum(1 for i in range(MAX_CHARTS) if self.query_one(f"#strip{i}").display)
        self._show_strips()

    def action_copy(self) -> None:
        self.query_one("#losses", Bars).action_copy()
