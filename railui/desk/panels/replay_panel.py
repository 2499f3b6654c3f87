"""Panel that replays recordings: play, pause, seek, speed."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, ClassVar, Final

from textual import on
from textual.binding import Binding
from textual.message import Message
from textual.timer import Timer

from railui.capture.formats import READERS
from railui.desk.messages import JobDone
from railui.desk.panels.common import JobPanel, set_titles
from railui.desk.presenters.choices import find_files
from railui.desk.presenters.recording_text import recording_rows
from railui.desk.services.jobs import LatestJobRunner
from railui.desk.services.playing import (
    StoredRecording,
    playback_status,
    read_played_run,
    stored_recording,
    stored_recordings,
)
from railui.desk.services.recording import RecordingStatus
from railui.desk.state.playback import Playback
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.dialogs import ChoiceDialog
from railui.desk.widgets.timeline import Timeline

FRAME_INTERVAL: Final = 0.1  # s between two pictures of a replay
SEEK_SECONDS: Final = 5.0  # s


class ReplayPanel(JobPanel):
    """Panel with a list of recordings and the replay of one of them."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("p,space", "play", "Play", key_display="p", tooltip="replay the recording under the cursor, or pause"),
        Binding("comma", "seek(-1)", "Back 5 s", show=False),
        Binding("full_stop", "seek(1)", "Forward 5 s", show=False),
        Binding("less_than_sign", "speed(-1)", "Slower", show=False),
        Binding("greater_than_sign", "speed(1)", "Faster", show=False),
        Binding("f", "file", "Recording", show=False, tooltip="replay a recording of any file"),
    ]

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.status: RecordingStatus | None = None
        self.playback: Playback | None = None
        self.recordings: list[StoredRecording] = []
        self.roles: dict[str, str] = {}  # in the campaign, by path
        self._opened: list[StoredRecording] = []  # files from elsewhere
        self._reader = LatestJobRunner(self, "replay")
        self._timer: Timer | None = None
        self._last_frame = 0.0

    def show_rows(self) -> None:
        """Show the newest rows of the recording or of the replay."""
        raise NotImplementedError

    def refresh_recordings(self) -> None:
        """Read the list of recordings."""
        stored = stored_recordings()
        known = {each.path for each in stored}
        self.recordings = [*stored, *(each for each in self._opened if each.path not in known)]
        self.show_recordings()

    def show_recordings(self) -> None:
        """Show the list of recordings with their roles."""
        self.query_one("#recordings", Bars).show(recording_rows(self.recordings, self.roles))
        self.update_commands()

    @property
    def selected(self) -> StoredRecording | None:
        """Recording under the cursor."""
        index = self.query_one("#recordings", Bars).index
        return self.recordings[index] if index < len(self.recordings) else None

    # commands

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "play":
            return self.job is None and (self.playback is not None or bool(self.recordings))
        if action in ("seek", "speed"):
            return self.playback is not None
        if action == "file":
            return self.job is None
        if action == "stop":
            return self.job is not None or self.playback is not None
        return super().check_action(action, parameters)

    def command_state(self) -> object:
        return super().command_state(), self.playback is not None, bool(self.recordings), len(self.roles)

    def action_play(self) -> None:
        """Pause or continue the replay; without one, replay the recording under the cursor."""
        if self.playback is not None:
            self.playback.toggle()
            self._show_playback()
        elif self.selected is not None:
            self.play(self.selected.path)

    def action_file(self) -> None:
        """Choose a file or directory to replay."""
        found = find_files(Path.cwd(), [f"*{suffix}{end}" for suffix in READERS for end in ("", ".gz")])
        stored = [(str(each.path), str(each.path)) for each in self.recordings]
        choices = [*stored, *((str(path), str(path.relative_to(Path.cwd()))) for path in found)]
        self.app.push_screen(ChoiceDialog("Replay a recording", choices, free=True), self._play_chosen)

    def _play_chosen(self, name: str | None) -> None:
        if name is None:
            return
        path = Path(name).expanduser()
        if path not in {each.path for each in self.recordings}:
            self._opened.append(stored_recording(path))
            self.refresh_recordings()
        self.play(path)

    def play(self, path: Path) -> None:
        """Read a recording in the background and replay it."""
        self.end_replay()

        def read() -> Message:
            return JobDone("replay", Playback(read_played_run(path)))

        self._reader.submit(read)

    @on(JobDone)
    def _on_read(self, message: JobDone) -> None:
        if message.name != "replay" or self.job is not None:
            return
        self.playback = message.result
        self._last_frame = time.monotonic()
        self._timer = self.set_interval(FRAME_INTERVAL, self._tick)
        self.arrange_parts()
        self._show_playback()
        self.query_one(Timeline).focus()

    def action_seek(self, by: int) -> None:
        """Move by some seconds."""
        if self.playback is not None:
            self.playback.seek(self.playback.position + by * SEEK_SECONDS)
            self._show_playback()

    def action_speed(self, by: int) -> None:
        """Replay faster or slower."""
        if self.playback is not None:
            self.playback.change_speed(by)
            self._show_playback()

    @on(Timeline.Moved)
    def _on_moved(self, message: Timeline.Moved) -> None:
        if self.playback is not None:
            self.playback.seek(message.fraction * self.playback.run.duration)
            self._show_playback()

    def action_stop(self) -> None:
        """End the recording or the replay."""
        if self.playback is not None:
            self.end_replay()
        else:
            super().action_stop()

    def end_replay(self) -> None:
        """End the replay; its last picture goes too."""
        if self._timer is not None:
            self._timer.stop()
            self._timer = None
        if self.playback is not None:
            self.playback = self.status = None
            self.arrange_parts()
            self.show_rows()
            self.show_status()

    # drawing

    def _tick(self) -> None:
        now = time.monotonic()
        playback, passed, self._last_frame = self.playback, now - self._last_frame, now
        if playback is not None and playback.is_playing:
            playback.advance(passed)
            if self.is_on_screen:
                self._show_playback()

    @property
    def is_on_screen(self) -> bool:
        """True if the panel is the one that is shown."""
        return self.display

    def _show_playback(self) -> None:
        playback = self.playback
        if playback is None:
            return
        self.status = playback_status(playback)
        places = playback.fractions([playback.clock, *(at for at, _ in playback.gaps)])
        timeline = self.query_one(Timeline)
        timeline.show(places[0], places[1:], playback.fractions([at for at, _ in playback.run.markers]))
        set_titles(timeline, sub=f"{playback.position:.1f} s · ×{playback.speed:g}")
        self.show_status()
        self.show_rows()
