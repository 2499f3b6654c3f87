"""Terminal user interface: panels, files, keys and commands."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, ClassVar

from rich.text import Text
from textual import on
from textual.app import App, ComposeResult, SystemCommand
from textual.binding import Binding
from textual.containers import Horizontal
from textual.dom import DOMNode
from textual.events import Event, Key, Resize
from textual.screen import Screen
from textual.widgets import ContentSwitcher, Footer, Static

from railui.desk.commands import OTHER_SYSTEM_COMMANDS, help_rows, palette_commands
from railui.desk.editing import show_problems
from railui.desk.ending import Ending
from railui.desk.exporting import export_all, export_focused
from railui.desk.focus import FocusKeeper, TooSmall
from railui.desk.heartbeat import Heartbeat, freeze_startup_objects, tune_interpreter
from railui.desk.messages import DesignOffered, FileOffered, PartChanged
from railui.desk.panels.campaign import CampaignPanel
from railui.desk.panels.capture import CapturePanel
from railui.desk.panels.common import PANELS, PanelTabs
from railui.desk.panels.design import DesignPanel
from railui.desk.panels.fleet import FleetPanel
from railui.desk.panels.optimise import OptimisePanel
from railui.desk.panels.track import TrackPanel
from railui.desk.presenters.choices import find_documents
from railui.desk.services.files import OPENED_KINDS, file_kind, load_state, log_traceback
from railui.desk.services.signals import handle_signals
from railui.desk.session import DeskSession
from railui.desk.state.draft import Draft
from railui.desk.state.form_rows import typed_speed_unit
from railui.desk.state.run_conditions import RunConditions
from railui.desk.widgets.dialogs import ChoiceDialog, HelpDialog
from railui.desk.widgets.plot import PLOT_CLASSES
from railui.io.problems import FileProblems, file_problem

MIN_COLUMNS = 60
MIN_ROWS = 18


class Desk(App[None]):
    """Terminal user interface of railui."""

    CSS_PATH = "desk.tcss"
    TITLE = "railui"
    COMPONENT_CLASSES: ClassVar[set[str]] = set(PLOT_CLASSES)
    HORIZONTAL_BREAKPOINTS = [(0, "-tiny"), (MIN_COLUMNS, "-narrow"), (100, "-mid"), (140, "-wide")]  # noqa: RUF012
    VERTICAL_BREAKPOINTS = [(0, "-flat"), (MIN_ROWS, "-low"), (36, "-high")]  # noqa: RUF012
    BINDINGS: ClassVar[list[Any]] = [
        Binding("question_mark,f1", "help", "Help", key_display="?", tooltip="keys and help of what has the focus"),
        Binding("ctrl+p", "command_palette", "All", tooltip="the command palette"),
        *(Binding(key, f"panel('{name}')", f"{title} panel", show=False) for name, (key, title) in PANELS.items()),
        Binding("z", "enlarge", "Enlarge", show=False, tooltip="the focused pane to the whole screen, and back"),
        Binding("E", "export", "Export", show=False, tooltip="the focused plot or list as SVG or CSV"),
        Binding("ctrl+o", "open", "Open"),
        Binding("ctrl+s", "save", "Save"),
        Binding("ctrl+q", "quit", "Quit", priority=True),
    ]

    def __init__(self, path: Path | None = None, *, is_plain: bool = False) -> None:
        super().__init__()
        self.path = path
        self.is_plain = is_plain
        self.heartbeat = Heartbeat()
        self.session = DeskSession(self)
        self.focus_keeper = FocusKeeper(self)
        self.ending = Ending(self)
        self.state = load_state()  # of the last session
        self._shown_name = ""
        self._heartbeat_task: asyncio.Task[None] | None = None

    def compose(self) -> ComposeResult:
        with Horizontal(id="bar"):
            yield PanelTabs(id="tabs")
            yield Static(id="status")
        yield TooSmall(id="too-small")
        with ContentSwitcher(initial="design"):
            yield DesignPanel(id="design")
            yield CampaignPanel(id="campaign")
            yield OptimisePanel(id="optimise")
            yield TrackPanel(id="track")
            yield CapturePanel(id="capture")
            yield FleetPanel(id="fleet")
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        self.theme = "ansi-dark" if self.is_plain else self._last_theme()
        self.screen.set_class(self.is_plain, "-plain")
        if self.is_plain:
            self.animation_level = "none"
        self._heartbeat_task = asyncio.get_running_loop().create_task(self.heartbeat.beat())
        self.call_after_refresh(freeze_startup_objects)
        self.action_panel("design")
        track = str(self.state.get("track", RunConditions.track))
        speed = float(self.state.get("speed", RunConditions.speed))
        self.design_panel.first_conditions = RunConditions(track, speed)
        self.design_panel.speed_unit = typed_speed_unit(f"0 {self.state.get('speed_unit')}") or "m/s"
        self.design_panel.view = int(self.state.get("view", 0))
        start = self.path or self.state.get("file")
        has_start = start is not None and (self.path is not None or Path(start).exists())
        if has_start:
            self.open(Path(str(start)))
        self.call_after_refresh(self._offer_session, None if has_start else self.action_open)
        self.watch(self.screen, "focused", self.focus_keeper.on_change, init=False)
        handle_signals(self.ending.on_signal)

    async def on_event(self, event: Event) -> None:
        if isinstance(event, Key) and not event.is_forwarded:
            self.focus_keeper.fill()
        await super().on_event(event)

    def _offer_session(self, otherwise: Callable[[], object] | None) -> None:
        """Offer the session that ended last; if there is none or it is declined, do something else."""
        if not self.session.offer(otherwise) and otherwise is not None:
            otherwise()

    def on_unmount(self) -> None:
        self.session.close()

    def notify(self, message: str, **options: Any) -> None:
        """Show a message without markup, because it may contain units in square brackets and names of files."""
        super().notify(message, **(options | {"markup": False}))

    def _last_theme(self) -> str:
        theme = str(self.state.get("theme", ""))
        return theme if theme in self.available_themes else "textual-dark"

    def on_resize(self, event: Resize) -> None:
        needed = f"the desk needs at least {MIN_COLUMNS} x {MIN_ROWS}"
        self.query_one("#too-small", Static).update(f"{event.size.width} x {event.size.height}: {needed}")

    @property
    def design_panel(self) -> DesignPanel:
        """Panel with the design in work."""
        return self.query_one(DesignPanel)

    def open(self, path: Path) -> None:
        """Open a design, a campaign, a study or a fleet in its panel, or show the problems of the file."""
        try:
            kind = file_kind(path)
            if kind == "campaign":
                self.query_one(CampaignPanel).open(path)
                self.action_panel("campaign")
                return
            if kind == "study":
                self.query_one(OptimisePanel).open(path)
                self.action_panel("optimise")
                return
            if kind == "fleet":
                self.query_one(FleetPanel).open(path)
                self.action_panel("fleet")
                return
            draft = Draft.load(path, self.design_panel.conditions)
        except (FileProblems, OSError) as error:
            problems = error if isinstance(error, FileProblems) else file_problem(path, str(error), "")
            show_problems(self, path, problems, lambda: self.open(path))
            return
        self.design_panel.open(draft)
        self.action_panel("design")
        for problem in draft.design.warnings:
            self.notify(f"{problem.key}: {problem.message}, {problem.remedy}", severity="warning", timeout=8)

    def action_open(self) -> None:
        choices = find_documents(Path.cwd(), ("design", *OPENED_KINDS))
        self.push_screen(ChoiceDialog("Open a design, campaign, study or fleet", choices, free=True), self._open_chosen)

    def _open_chosen(self, chosen: str | None) -> None:
        if chosen is None:
            return
        path = Path(chosen).expanduser()
        kind = file_kind(path)
        if kind == "campaign":
            self.query_one(CampaignPanel).request_open(path, lambda: self.open(path))
        elif kind in ("study", "fleet"):
            self.open(path)
        else:
            self.ending.after_saving(lambda: self.open(path))

    def action_save(self) -> None:
        self.design_panel.save()

    # panels

    def action_panel(self, name: str) -> None:
        self.query_one(ContentSwitcher).current = name
        self.clear_notifications()  # those of the panel before
        if name == "track":
            self._show_track()
        self.query_one(PanelTabs).show(name)
        self.screen_stack[0].minimize()
        self.focus_keeper.enter_panel()

    def action_export(self) -> None:
        export_focused(self)

    def action_enlarge(self) -> None:
        """Enlarge the focused pane to the whole screen, or show all panes again."""
        if self.screen.maximized is not None:
            self.screen.minimize()
        elif self.focused is not None:
            self.screen.maximize(self.focused)

    def _show_track(self) -> None:
        draft, conditions = self.design_panel.draft, self.design_panel.conditions
        vehicle = None
        if draft is not None and draft.design.kind != "rig":
            vehicle = (draft.design, conditions.speed)
        self.query_one(TrackPanel).show_for(conditions.track, vehicle)

    @property
    def panel(self) -> DOMNode:
        """Panel that is open."""
        return self.query_one(f"#{self.query_one(ContentSwitcher).current}")

    @on(DesignPanel.Changed)
    def _on_design_changed(self) -> None:
        draft = self.design_panel.draft
        if draft is None:
            return
        status = Text(f"{draft.name.removesuffix('.yaml')}{' ●' if draft.is_modified else '  '}")
        self.query_one("#status", Static).update(status, layout=draft.name != self._shown_name)
        self._shown_name = draft.name
        self.session.store_form()
        if draft.design.kind != "rig":
            self.query_one(OptimisePanel).suggest_plan(draft.design, self.design_panel.conditions)

    @on(PartChanged)
    def _on_part_changed(self, event: PartChanged) -> None:
        self.session.store(event.part)

    @on(TrackPanel.TrackChosen)
    def _on_track_chosen(self, event: TrackPanel.TrackChosen) -> None:
        if self.design_panel.set("case.track", event.track):
            self.action_panel("design")

    @on(OptimisePanel.DesignRequested)
    def _on_design_requested(self) -> None:
        draft = self.design_panel.draft
        if draft is not None:
            self.query_one(OptimisePanel).use_design(draft.design)
            self.notify(f"the plan uses {draft.name} in its current state", timeout=3)

    @on(DesignOffered)
    def _on_design_offered(self, event: DesignOffered) -> None:
        """Open the design of a loop or a search in the form with the nominal design as its base."""

        def take() -> None:
            conditions = self.design_panel.conditions
            draft = Draft(event.design, base=event.nominal, conditions=conditions, new_path=event.new_path)
            self.design_panel.open(draft)
            self.action_panel("design")
            self.notify(event.description, timeout=4)

        self.ending.after_saving(take)

    @on(FileOffered)
    def _on_file_offered(self, event: FileOffered) -> None:
        self.query_one(CampaignPanel).request_open(event.path, lambda: self.open(event.path))

    # help, copying, quitting

    def _active_nodes(self) -> list[DOMNode]:
        return [self.panel, *([self.focused] if self.focused is not None else [])]

    def action_help(self) -> None:
        texts = [text for node in self._active_nodes() if (text := getattr(node, "HELP", None))]
        self.push_screen(HelpDialog(texts, help_rows(self.screen)))

    def action_help_quit(self) -> None:
        """Copy on ctrl+c; ctrl+q quits."""
        for node in (self.focused, self.panel):
            if node is not None and hasattr(node, "action_copy"):
                node.action_copy()
                return
        self.notify("ctrl+c copies, ctrl+q quits")

    async def action_quit(self) -> None:
        self.ending.ask_and_quit()

    def get_system_commands(self, screen: Screen[Any]) -> Iterable[SystemCommand]:
        yield from palette_commands(self, screen)
        yield from (each for each in super().get_system_commands(screen) if each.title in OTHER_SYSTEM_COMMANDS)
        yield SystemCommand("Save as", "save the design in another file", self.design_panel.save_as)
        yield SystemCommand("Export all", "every picture and table of the panel", lambda: export_all(self))
        yield SystemCommand("Restore session", "restore work of a session that has ended", self.session.choose)
        delay = f"longest delay of the interface caused by the desk: {1e3 * self.heartbeat.longest_gap:.0f} ms"
        yield SystemCommand("Heartbeat", delay, lambda: self.notify(delay))

    def _fatal_error(self) -> None:
        """Log the traceback of an internal error, restore the terminal and print the path of the log."""
        if (error := sys.exc_info()[1]) is not None:
            text = f"railui desk: {type(error).__name__}: {error}\ntraceback: {log_traceback(error)}"
            self._exit_renderables.append(Text(text))
        self.session.autosave.flush()
        self._close_messages_no_wait()


def run(path: Path | None = None, *, plain: bool = False) -> int:
    """Run the desk until it is quit; return the exit code."""
    tune_interpreter()
    desk = Desk(path, is_plain=plain)
    desk.run()
    return desk.return_code or 0
