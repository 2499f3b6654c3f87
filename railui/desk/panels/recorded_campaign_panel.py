"""Panel that builds a campaign from recordings and opens it."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

from textual import on
from textual.binding import Binding
from textual.message import Message

from railui.api.recorded_campaign import write_recorded_campaign
from railui.desk.messages import FileOffered, JobDone, ProgressMessage
from railui.desk.panels.replay_panel import ReplayPanel
from railui.desk.presenters.choices import find_documents
from railui.desk.presenters.recording_text import ROLES
from railui.desk.services.jobs import BackgroundJob
from railui.desk.widgets.dialogs import ChoiceDialog, InputDialog

NO_MAP = "no sensor map below this directory: railui import RECORDING --draft map.yaml writes a draft"


class RecordedCampaignPanel(ReplayPanel):
    """Panel whose recordings have roles in a campaign."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("e", "role", "Role", tooltip="estimation, validation or none, of the recording under the cursor"),
        Binding("C", "campaign", "Campaign", tooltip="build a campaign from the recordings with a role"),
    ]

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "role":
            return bool(self.recordings)
        if action == "campaign":
            return self.job is None and bool(self.roles)
        return super().check_action(action, parameters)

    def action_role(self) -> None:
        """Give the recording under the cursor the next role, or none after the last."""
        if (selected := self.selected) is not None:
            order = [None, *ROLES]
            role = order[(order.index(self.roles.pop(str(selected.path), None)) + 1) % len(order)]
            if role is not None:
                self.roles[str(selected.path)] = role
            self.show_recordings()

    def action_campaign(self) -> None:
        """Ask for the sensor map and the directory, and build the campaign."""
        missing = [words for role, words in ROLES.items() if role not in self.roles.values()]
        if missing:
            self.notify(f"no recording for {' and '.join(missing)}: e gives the one under the cursor a role")
            return
        maps = find_documents(Path.cwd(), ("map",))
        if not maps:
            self.notify(NO_MAP, severity="warning")
        self.app.push_screen(ChoiceDialog("Sensor map", maps, free=True), self._ask_directory)

    def _ask_directory(self, map_file: str | None) -> None:
        if map_file is None:
            return

        def build(directory: str | None) -> None:
            if directory is not None:
                self._build(Path(map_file).expanduser(), Path(directory).expanduser())

        self.app.push_screen(InputDialog("Directory of the campaign", "campaign"), build)

    def _build(self, map_file: Path, directory: Path) -> None:
        by_role = {role: [path for path, each in self.roles.items() if each == role] for role in ROLES}
        self.end_replay()

        def run(job: BackgroundJob) -> Message:
            def say(text: str) -> None:
                job.checkpoint()
                self.post_message(ProgressMessage(job.name, text))

            return JobDone(job.name, write_recorded_campaign(map_file, by_role, directory, on_progress=say))

        self.job = BackgroundJob(self, "campaign", run)
        self.show_status()

    @on(JobDone)
    def _on_built(self, message: JobDone) -> None:
        if message.name != "campaign":
            return
        self.job = None
        for note in message.result.notes:
            self.notify(note, timeout=8)
        self.show_status()
        self.post_message(FileOffered(message.result.path))
