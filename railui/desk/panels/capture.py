"""Capture panel: recording of a serial logger with strip charts, level meters, losses and markers; replay."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Any, ClassVar, Final

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Grid, Horizontal, Vertical
from textual.message import Message
from textual.widgets import Static

from railui.capture.protocol.load import BAUD_RATES
from railui.desk.messages import JobDone, JobFailed, ProgressEvent, ProgressMessage
from railui.desk.panels.common import COPY, STOP, Pane, arrange_grid, set_titles
from railui.desk.panels.recorded_campaign_panel import RecordedCampaignPanel
from railui.desk.presenters.choices import DEMO_PORT, port_choices
from railui.desk.presenters.recording_text import channel_rows, link_rows, playback_text, strip_plot
from railui.desk.services.jobs import BackgroundJob
from railui.desk.services.playing import RECORDINGS
from railui.desk.services.recording import DeskRecording
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.dialogs import ChoiceDialog, InputDialog
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.plot_data import PlotData
from railui.desk.widgets.timeline import Timeline

MAX_CHARTS = 6
DEFAULT_BAUD_RATE = 115200
CHART_WINDOWS: Final = (5.0, 10.0, 30.0, 2.0)  # s of the strip charts, in the order of the key
NO_PLOT = PlotData(Axis(""), Axis(""), placeholder="s starts recording")
ROWS_FOR_ALL = 32  # of the panel, from which losses, channels and recordings are all shown


class CapturePanel(RecordedCampaignPanel):
    """Port, counters, level meters and recordings on the left, strip charts on the right."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("s", "start", "Record"),
        STOP,
        Binding("m", "mark", "Mark"),
        Binding("o", "port", "Port"),
        Binding("r", "baud", "Baud", show=False),
        Binding("v", "view(1)", "Channels"),
        Binding("w", "window", "Seconds", show=False, tooltip="seconds of the strip charts: 2, 5, 10, 30"),
        COPY,
    ]
    HELP = """
## Capture
`o` chooses a serial port (or the **demo** logger, a simulated vehicle in a separate process), `r` the baud rate. `s`
records: raw bytes are written to the disk first, decoded runs next to them. The bars show the load of the serial link
and the losses: frames by their numbers, samples by their times. `m` marks the current instant with a label, `k` ends
the recording. `v` shows other channels, `w` more or fewer seconds; lines are interrupted at gaps.

**Level meters**: the highest value of the last half second, 0 to 60 dB below the end of the channel's range, and as a
line that of the seconds kept; a clipped channel is named. Channels without a known range are compared with their own
highest value.

**Recordings**: `p` replays the one under the cursor and pauses, `,` and `.` move by 5 s, `<` and `>` change the speed,
a click on the timeline moves there, `k` ends the replay; `f` replays any file that `railui import` reads. `e` gives the
recording under the cursor a role, estimation or validation; `C` builds the campaign with a sensor map and opens it.
"""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.port = DEMO_PORT
        self.baud = DEFAULT_BAUD_RATE
        self.recording: DeskRecording | None = None
        self.directory: Path | None = None
        self.lines: list[str] = []
        self.seconds = CHART_WINDOWS[0]

    def compose(self) -> ComposeResult:
        with Horizontal():
            with Vertical(id="capture-left"):
                yield Pane("Port", id="port")
                yield Timeline("Replay", id="timeline")
                yield Bars("Link and losses", "nothing recorded yet", id="losses")
                yield Bars("Channels", "no channels yet", id="channels", has_cursor=True)
                yield Bars("Recordings", "none in railui-capture", id="recordings", has_cursor=True)
            with Grid(id="strips"):
                for i in range(MAX_CHARTS):
                    yield Plot(NO_PLOT, f"channel {i + 1}", id=f"strip{i}")

    def on_mount(self) -> None:
        self.show_status()

    def on_show(self) -> None:
        self.refresh_recordings()

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
            return self.job is None and self.playback is None
        return super().check_action(action, parameters)

    def action_start(self) -> None:
        if self.job is not None:
            self.notify("a recording is running: k stops it")
            return
        self.end_replay()
        self.directory = RECORDINGS / datetime.now().strftime("%Y-%m-%d_%H%M%S")
        self.status = None
        self.lines = []
        recording = DeskRecording(self.port, self.baud, self.directory, self._post_line)
        self.recording = recording
        self.job = BackgroundJob(self, "capture", lambda job: self._record(job, recording))
        self.arrange_parts()
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
        fault = message.event.link_fault
        if fault and (self.status is None or self.status.link_fault != fault):
            self.notify(fault, severity="warning")
        self.status = message.event
        self.show_status()
        self.show_rows()

    @on(ProgressMessage)
    def _on_line(self, message: ProgressMessage) -> None:
        self.lines.append(message.text)
        self.show_status()

    @on(JobDone)
    def _on_recorded(self, message: JobDone) -> None:
        if message.name != "capture":
            return
        self.job = None
        report = message.result
        self.lines.append(f"written to {self.directory}: {report['samples']} samples, {report['lost']} frames lost")
        for note in report["notes"]:
            self.notify(note, severity="warning")
        self.refresh_recordings()
        self.arrange_parts()
        self.show_status()

    @on(JobFailed)
    def _on_failed(self, message: JobFailed) -> None:
        if message.name != "replay":
            self.job = None
            self.recording = None
        self.lines.append(message.text)
        self.notify(message.text, severity="error", timeout=10)
        self.show_status()

    # drawing

    def show_status(self) -> None:
        """Show the port, the state of the recording, and its last message; or the state of the replay."""
        pane = self.query_one("#port", Static)
        if self.playback is not None:
            pane.update(playback_text(self.playback), layout=False)
            set_titles(pane, "Replay", "replay" if self.playback.is_playing else "paused")
        else:
            pane.update(self._port_text(), layout=False)
            state = {"capture": "recording", "campaign": "building the campaign"}
            set_titles(pane, "Port", "" if self.job is None else state[self.job.name])
        self.update_commands()

    def _port_text(self) -> Text:
        text = Text(no_wrap=True, overflow="ellipsis")
        text.append(f"{self.port}, {self.baud} baud\n", "bold")
        status = self.status
        if self.job is None:
            text.append("o port, r baud, s records, p replays\n", "dim")
        elif self.job.name == "capture" and status is None:
            text.append("opening the port\n")
        elif status is not None:
            text.append(f"{status.device or 'waiting for data'}, {status.seconds:.1f} s\n")
        if self.job is not None and status is not None and status.link_fault:
            text.append(status.link_fault.partition(":")[0], "bold red")
        else:
            text.append(self.lines[-1] if self.lines else "", "yellow")
        return text

    def show_rows(self) -> None:
        """Show losses, channels and strip charts of the recording or of the replay."""
        if self.status is not None:
            self.query_one("#losses", Bars).show(link_rows(self.status))
            channels = self.query_one("#channels", Bars)
            channels.show(channel_rows(self.status))
            set_titles(channels, sub=f"{self.status.rate:.4g} Hz")
        self._show_strips()

    def _show_strips(self) -> None:
        """Draw the last seconds of as many channels as fit."""
        status = self.status
        for i in range(MAX_CHARTS):
            plot = self.query_one(f"#strip{i}", Plot)
            if not plot.display:
                continue
            if status is None or not status.names:
                plot.show(NO_PLOT)
                continue
            channel = (self.view + i) % len(status.names)
            set_titles(plot, status.names[channel])
            plot.show(strip_plot(status, channel, self.seconds))

    def arrange_parts(self) -> None:
        """Show as many strip charts as fit; in few rows the losses of a recording, else the list of recordings."""
        arrange_grid(self.query_one("#strips", Grid), [self.query_one(f"#strip{i}") for i in range(MAX_CHARTS)], 0)
        has_room = self.size.height >= ROWS_FOR_ALL
        is_recording = self.job is not None
        self.query_one("#timeline").display = self.playback is not None
        self.query_one("#losses").display = is_recording or (has_room and self.playback is None)
        self.query_one("#recordings").display = has_room or not is_recording
        self._show_strips()

    def action_window(self) -> None:
        """Show more or fewer seconds in the strip charts."""
        self.seconds = CHART_WINDOWS[(CHART_WINDOWS.index(self.seconds) + 1) % len(CHART_WINDOWS)]
        self._show_strips()

    def action_view(self, by: int) -> None:
        """Show the next channels."""
        self.view += by * sum(1 for i in range(MAX_CHARTS) if self.query_one(f"#strip{i}").display)
        self._show_strips()

    def action_copy(self) -> None:
        self.query_one("#losses", Bars).action_copy()
